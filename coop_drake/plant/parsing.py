"""Models from directives into a plant: no gravity, one actuator for each joint of q."""

import logging
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import ModelDirectives, PackageMap, Parser, ProcessModelDirectives
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, JointActuator, ModelInstanceIndex, RigidBody

from coop_drake.errors import ScenarioError
from coop_drake.scenario import Assembly, RobotAssembly, Scenario

_REPLACED = re.compile(r"invalid inertia|inertia matrix|central inertia|Using default value")
"""Warnings by which Drake says that it went on with a mass or a size other than the file's."""


def add_models(
    scenario: Scenario,
    assembly: Assembly,
    indices: Sequence[int],
    plant: MultibodyPlant,
    scene_graph: SceneGraph | None,
) -> None:
    """Process directives into a plant that is not finalized yet, and switch gravity off.

    Args:
        scenario: For messages.
        assembly: The directives.
        indices: Which of them.
        plant: Receives the models.
        scene_graph: Receives the geometry, if any is wanted.

    Raises:
        ScenarioError: Drake refuses a model or a directive, or would replace a mass or size by its own.
    """
    complaint = _process(assembly, indices, plant, scene_graph)
    if complaint:
        at = _culprit(assembly, indices)
        raise ScenarioError(
            str(scenario.path),
            assembly.keys[at],
            _subject(assembly, at),
            f"what Drake can read ({complaint})",
        )
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])


def _process(
    assembly: Assembly, indices: Sequence[int], plant: MultibodyPlant, scene_graph: SceneGraph | None
) -> str:
    """Process directives; what Drake complained about, or nothing."""
    parser = Parser(plant, scene_graph) if scene_graph else Parser(plant)
    parser.package_map().AddMap(_missing(assembly, parser))
    try:
        with _warnings() as said:
            ProcessModelDirectives(
                ModelDirectives(directives=[assembly.directives[index] for index in indices]), parser
            )
    except (RuntimeError, ValueError, SystemExit) as error:  # pydrake exits where Drake's C++ would abort
        return " ".join(str(error).split())
    replaced = (" ".join(message.split()) for message in said if _REPLACED.search(message))
    return "; ".join(dict.fromkeys(replaced))


def _missing(assembly: Assembly, parser: Parser) -> PackageMap:
    """The scenario's packages without those that the parser has already."""
    packages = PackageMap(assembly.packages)
    for name in packages.GetPackageNames():
        if parser.package_map().Contains(name):
            packages.Remove(name)
    return packages


def _culprit(assembly: Assembly, indices: Sequence[int]) -> int:
    """Index of the first directive that Drake refuses when they are added one after the other."""
    for count in range(1, len(indices)):
        plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
        plant.RegisterAsSourceForSceneGraph(scene_graph)
        if _process(assembly, indices[:count], plant, scene_graph):
            return indices[count - 1]
    return indices[-1]


def _subject(assembly: Assembly, index: int) -> str:
    """What a directive is about, in a few words."""
    directive = assembly.directives[index]
    if directive.add_model:
        return str(directive.add_model.file.removeprefix("file://"))
    if directive.add_weld:
        return f"{directive.add_weld.parent}, {directive.add_weld.child}"
    named = directive.add_frame or directive.add_model_instance or directive.add_collision_filter_group
    return str(named.name)


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Collect what Drake warns about meanwhile, also while its logger keeps silent or is switched off."""
    records: list[logging.LogRecord] = []
    said: list[str] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            records.append(record)
            said.append(record.getMessage())

    logger = logging.getLogger("drake")
    ours = {"handlers": [Collector()], "filters": [], "propagate": False, "disabled": False}
    theirs = {name: getattr(logger, name) for name in (*ours, "level")}
    switched_off = logging.root.manager.disable
    vars(logger).update(ours)
    logging.disable(logging.NOTSET)
    logger.setLevel(logging.WARNING)
    try:
        yield said
    finally:
        vars(logger).update(theirs)
        logging.disable(switched_off)  # This lets Drake know of the level put back, too.
        for record in records:
            if logger.isEnabledFor(record.levelno) and not _REPLACED.search(record.getMessage()):
                logger.handle(record)


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
    limits and rotor inertias that a file states are kept; Drake saturates torques at the limits.

    Args:
        plant: Not finalized yet.
        joints: All joints of q, in q's order.
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
