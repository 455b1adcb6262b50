"""Models from directives into a plant: no gravity, one actuator for each joint of q."""

from collections.abc import Sequence

from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import ModelDirectives, PackageMap, Parser, ProcessModelDirectives
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, JointActuator, ModelInstanceIndex, RigidBody

from coop_drake.errors import ScenarioError
from coop_drake.scenario import Assembly, RobotAssembly, Scenario


def add_models(
    scenario: Scenario,
    assembly: Assembly,
    directives: ModelDirectives,
    plant: MultibodyPlant,
    scene_graph: SceneGraph | None,
) -> None:
    """Process directives into a plant that is not finalized yet, and switch gravity off.

    Raises:
        ScenarioError: Drake refuses a model or a directive.
    """
    parser = Parser(plant, scene_graph) if scene_graph else Parser(plant)
    parser.package_map().AddMap(_missing(assembly, parser))
    try:
        ProcessModelDirectives(directives, parser)
    except (RuntimeError, ValueError) as error:
        raise ScenarioError(
            str(scenario.path), "directives", str(error), "models and directives that Drake can read"
        ) from error
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])


def _missing(assembly: Assembly, parser: Parser) -> PackageMap:
    """The scenario's packages without those that the parser has already."""
    packages = assembly.packages.__copy__()
    for name in packages.GetPackageNames():
        if parser.package_map().Contains(name):
            packages.Remove(name)
    return packages


def bodies_of(plant: MultibodyPlant, models: Sequence[str]) -> list[RigidBody]:
    """Bodies of some models and of the models nested inside them, in the plant's order."""
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
    """An error that points at the directive that adds the robot, or at the object."""
    return ScenarioError(str(scenario.path), robot.key if robot else "object", value, allowed)


def set_actuators(plant: MultibodyPlant, joints: Sequence[Joint]) -> None:
    """Give every joint of q exactly one actuator, so that the actuation input is the torques in q's order.

    Drake adds actuators only to joints whose file grants them effort; here every arm joint is driven. Effort
    limits and rotor inertias that a file states are kept.

    Args:
        plant: Not finalized yet.
        joints: All joints of q, in q's order.
    """
    stated: dict[int, JointActuator] = {}
    for index in plant.GetJointActuatorIndices():
        actuator = plant.get_joint_actuator(index)
        stated[int(actuator.joint().index())] = actuator
    kept = {
        joint: (a.effort_limit(), a.default_rotor_inertia(), a.default_gear_ratio())
        for joint, a in stated.items()
    }
    for actuator in stated.values():
        plant.RemoveJointActuator(actuator)
    for joint in joints:
        effort, inertia, ratio = kept.get(int(joint.index()), (float("inf"), 0.0, 1.0))
        added = plant.AddJointActuator(f"{joint.name()}_motor", joint, effort)
        added.set_default_rotor_inertia(inertia)
        added.set_default_gear_ratio(ratio)
