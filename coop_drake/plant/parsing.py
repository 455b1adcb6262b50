"""Adds models to a plant by directives: without gravity, with one actuator for each joint of q."""

from collections.abc import Sequence
from pathlib import Path

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, JointActuator, ModelInstanceIndex, RigidBody

from coop_drake.errors import ScenarioError
from coop_drake.plant.model_text import fault_of
from coop_drake.plant.processing import process
from coop_drake.scenario import Assembly, RobotAssembly, Scenario


def add_models(
    scenario: Scenario,
    assembly: Assembly,
    indices: Sequence[int],
    plant: MultibodyPlant,
    scene_graph: SceneGraph | None,
) -> None:
    """Process some of the directives into a plant that is not finalized yet, and switch gravity off.

    The scene graph receives the geometry, if any is wanted.

    Raises:
        ScenarioError: Drake refuses a model or a directive, or would replace a mass or a size by a default.
    """
    for index in indices:
        model = assembly.directives[index].add_model
        fault = fault_of(Path(model.file.removeprefix("file://"))) if model else ""
        if fault:
            raise _refusal(scenario, assembly, index, fault)
    complaint = process(assembly, indices, plant, scene_graph)
    if complaint:
        raise _refusal(scenario, assembly, _culprit(assembly, indices, complaint), complaint)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])


def _refusal(scenario: Scenario, assembly: Assembly, at: int, complaint: str) -> ScenarioError:
    subject, allowed = _subject(assembly, at), f"what Drake can read ({complaint})"
    return ScenarioError(str(scenario.path), assembly.keys[at], subject, allowed)


def _culprit(assembly: Assembly, indices: Sequence[int], complaint: str) -> int:
    """Index of the directive whose file Drake's message names, otherwise of the first that Drake refuses."""
    models = [(index, assembly.directives[index].add_model) for index in indices]
    named = [index for index, model in models if model and model.file.removeprefix("file://") in complaint]
    if len({_subject(assembly, index) for index in named}) == 1:
        return named[0]
    for count in range(1, len(indices)):
        plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
        plant.RegisterAsSourceForSceneGraph(scene_graph)
        if process(assembly, indices[:count], plant, scene_graph):
            return indices[count - 1]
    return indices[-1]


def _subject(assembly: Assembly, index: int) -> str:
    """The file or the names that a directive is about."""
    directive = assembly.directives[index]
    if directive.add_model:
        return str(directive.add_model.file.removeprefix("file://"))
    if directive.add_weld:
        return f"{directive.add_weld.parent}, {directive.add_weld.child}"
    named = directive.add_frame or directive.add_model_instance or directive.add_collision_filter_group
    return str(named.name)


def finalize(scenario: Scenario, plant: MultibodyPlant) -> None:
    """Finalize a plant.

    Raises:
        ScenarioError: The joints close a loop, or Drake cannot model them otherwise.
    """
    try:
        plant.Finalize()
    except RuntimeError as error:
        raise ScenarioError(
            str(scenario.path), "directives", "the joints of all models", f"a tree of bodies ({error})"
        ) from error


def bodies_of(plant: MultibodyPlant, models: Sequence[str]) -> list[RigidBody]:
    """The bodies of the named models and of the models nested inside them, in the plant's order."""
    return [
        plant.get_body(index)
        for name in models
        for instance in _instances(plant, name)
        for index in plant.GetBodyIndices(instance)
    ]


def _instances(plant: MultibodyPlant, name: str) -> list[ModelInstanceIndex]:
    instances = [ModelInstanceIndex(i) for i in range(plant.num_model_instances())]
    names = [plant.GetModelInstanceName(instance) for instance in instances]
    return [i for i, n in zip(instances, names, strict=True) if n == name or n.startswith(f"{name}::")]


def joints_of(plant: MultibodyPlant) -> list[Joint]:
    """All joints of a plant, in the order they were added."""
    return [plant.get_joint(index) for index in plant.GetJointIndices()]


def refusal(scenario: Scenario, robot: RobotAssembly | None, value: str, allowed: str) -> ScenarioError:
    """An error whose key is the directive that adds the robot, or the object."""
    return ScenarioError(str(scenario.path), robot.key if robot else "object", value, allowed)


def set_actuators(plant: MultibodyPlant, joints: Sequence[Joint]) -> None:
    """Give every joint of q exactly one actuator, so that the actuation input holds the torques in q's order.

    Drake adds actuators only to joints with an effort limit above zero in their file; here every arm joint is
    driven. Effort limits and rotor inertias of the file are kept; Drake saturates torques at the limits. The
    plant must not be finalized yet.
    """
    stated: list[JointActuator] = [plant.get_joint_actuator(i) for i in plant.GetJointActuatorIndices()]
    kept = {
        int(a.joint().index()): (a.effort_limit(), a.default_rotor_inertia(), a.default_gear_ratio())
        for a in stated
    }
    for actuator in stated:
        plant.RemoveJointActuator(actuator)
    for joint in joints:
        effort, inertia, ratio = kept.get(int(joint.index()), (float("inf"), 0.0, 1.0))
        added = plant.AddJointActuator(f"{joint.name()}_motor", joint, effort)
        added.set_default_rotor_inertia(inertia)
        added.set_default_gear_ratio(ratio)
