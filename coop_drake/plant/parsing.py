"""Reads models and directives into a MultibodyPlant: their text, what Drake says, each model only once."""

from __future__ import annotations

import logging
import re
import weakref
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from functools import wraps
from math import isfinite, isnan
from pathlib import Path
from typing import Concatenate, ParamSpec, TypeVar
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import (
    AddModel,
    GetScopedFrameByName,
    ModelDirective,
    ModelDirectives,
    PackageMap,
    Parser,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, JointActuator, ModelInstanceIndex, RigidBody
from pydrake.systems.framework import DiagramBuilder

from coop_drake.errors import ScenarioError
from coop_drake.files import check_readable
from coop_drake.scenario import Assembly, RobotAssembly, Scenario

_ROOTS = {".sdf": "sdf", ".urdf": "robot"}
_LARGEST = 20.0
"""Largest model file [MB]; whole robots have less than one."""
_DEEPEST = 100
"""Elements inside each other that are allowed; models have about ten, and Drake's readers recurse."""
_URDF: dict[str, tuple[str, str]] = {
    "robot": ("link joint material transmission gazebo", "name version"),
    "link": ("inertial visual collision", "name type"),
    "inertial": ("origin mass inertia", ""),
    "visual": ("origin geometry material", "name"),
    "collision": ("origin geometry", "name"),
    "geometry": ("box cylinder sphere mesh capsule", ""),
    "joint": ("origin parent child axis calibration dynamics limit mimic safety_controller", "name type"),
    "origin": ("", "xyz rpy"),
    "mass": ("", "value"),
    "inertia": ("", "ixx ixy ixz iyy iyz izz"),
    "box": ("", "size"),
    "cylinder": ("", "radius length"),
    "capsule": ("", "radius length"),
    "sphere": ("", "radius"),
    "mesh": ("", "filename scale"),
    "parent": ("", "link"),
    "child": ("", "link"),
    "axis": ("", "xyz"),
    "limit": ("", "lower upper effort velocity"),
    "mimic": ("", "joint multiplier offset"),
    "dynamics": ("", "damping friction"),
}
"""Elements of URDF with the elements and attributes that they may have; other names are extensions, unless
they resemble one of these."""
_ALIKE = 0.8
"""Similarity of two names, by difflib's ratio, from which one counts as a misspelling of the other [-]."""
_LIMITS = ("lower", "upper", "effort", "velocity")
"""Numbers that may be infinite."""
_MAGNITUDES = ("velocity", "drake:acceleration")
"""Limits that Drake's reader of URDF ends the process over where they are negative; in SDF these are none."""
_COUNTS: dict[str, tuple[int, ...]] = {
    **dict.fromkeys(("mass", "ixx", "ixy", "ixz", "iyy", "iyz", "izz", "radius", "length", "damping"), (1,)),
    **dict.fromkeys(_LIMITS, (1,)),
    "xyz": (3,),
}
"""How many numbers stand in elements of SDF and attributes of URDF of one name."""
_SDF_COUNTS = _COUNTS | {"pose": (6, 7), "size": (2, 3), "scale": (3,)}
_SDF_COUNTS |= dict.fromkeys(("ambient", "diffuse", "specular", "emissive"), (3, 4))
_URDF_COUNTS = _COUNTS | {"rpy": (3,), "size": (3,), "scale": (1, 3), "rgba": (4,)}
_URDF_COUNTS |= dict.fromkeys(("value", "friction", "multiplier", "offset"), (1,))


class _FaultError(Exception):
    """A fault in the text; its place is where the parser stands."""


def fault_of(path: Path) -> str:
    """Describe the first fault in the text of a model file, with its line; an empty text if there is none.

    The file exists; its suffix says its format.
    """
    reader = _ModelText(path.suffix)
    try:
        reader.parser.Parse(check_readable(path, _LARGEST).read_bytes(), True)
    except expat.ExpatError as error:
        return f"{path}: line {error.lineno}: {expat.ErrorString(error.code)}"
    except (_FaultError, LookupError) as error:  # LookupError: the file names an unknown encoding
        return f"{path}: line {reader.parser.CurrentLineNumber}: {error}"
    except OSError as error:
        return str(error)
    return ""


class _ModelText:
    """Handlers of an XML parser that raise at the first fault."""

    def __init__(self, suffix: str) -> None:
        self.suffix = suffix
        self.ancestors: list[str] = []
        self.text = ""
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._add_text
        self.parser.EntityDeclHandler = self._entity

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        root = _ROOTS[self.suffix]
        if not self.ancestors and name != root:
            raise _FaultError(f"<{name}> is the root; a {self.suffix} file has <{root}>")
        if len(self.ancestors) >= _DEEPEST:
            raise _FaultError(f"more than {_DEEPEST} elements inside each other")
        if self.suffix == ".urdf":
            self._check_urdf(name, attributes)
        self.ancestors.append(name)
        self.text = ""

    def _end(self, name: str) -> None:
        if self.suffix == ".sdf" and self.text.split():  # an empty element has its default
            _check_numbers(f"<{name}>", name, self.text, _SDF_COUNTS)
        self.ancestors.pop()
        self.text = ""

    def _add_text(self, text: str) -> None:
        self.text += text

    def _check_urdf(self, name: str, attributes: dict[str, str]) -> None:
        parent = self.ancestors[-1] if self.ancestors else ""
        if parent in _URDF:
            _check_name(f"<{name}>", name, _URDF[parent][0].split())
        if name in _URDF and (parent in _URDF or not parent):
            for attribute, value in attributes.items():
                shown = f"{attribute} of <{name}>"
                _check_name(shown, attribute, _URDF[name][1].split())
                _check_numbers(shown, attribute, value, _URDF_COUNTS)
                if attribute in _MAGNITUDES and _number(value) < 0.0:
                    raise _FaultError(f"{value!r} in {shown} is negative; expected a magnitude")

    def _entity(self, name: str, *_: object) -> None:
        raise _FaultError(f"the entity {name} is declared; Drake's readers know none")


def _check_name(shown: str, name: str, known: list[str]) -> None:
    """Refuse a name that is unknown but resembles a known one; names with a prefix are extensions."""
    if name not in known and ":" not in name:
        for meant in get_close_matches(name, known, n=1, cutoff=_ALIKE):
            raise _FaultError(f"{shown} is unknown; {meant} is meant?")


def _check_numbers(shown: str, name: str, text: str, counts: dict[str, tuple[int, ...]]) -> None:
    """Refuse text that is not as many finite numbers as stand under a name."""
    if name not in counts:
        return
    words = text.split()
    for word in words:
        number = _number(word)
        if isnan(number) or not (isfinite(number) or name in _LIMITS):
            raise _FaultError(f"{word!r} in {shown} is no finite number")
    if len(words) not in counts[name]:
        raise _FaultError(f"{shown} has {len(words)} numbers, not {' or '.join(map(str, counts[name]))}")


def _number(word: str) -> float:
    """The number that a word is, NaN if it is none."""
    try:
        return float(word) if "_" not in word else float("nan")
    except ValueError:
        return float("nan")


# Runs Drake's reader of models, and collects its errors and the warnings that are errors to us.


_REPLACED = re.compile(r"invalid inertia|inertia matrix|central inertia|Using default value")
"""Warnings by which Drake says that it went on with a mass or a size other than the file's."""
_NEEDS_ITS_PLACE = re.compile(
    r"<include|<world|<!(?!--)|encoding=|<uri\b(?!>package://)|_map\b|collision_filter"
)
"""What an SDF file has that cannot be read as a text alone."""
_NAME = re.compile(r"""(<model\s+name\s*=\s*)("[^"]*"|'[^']*')""")
"""The name of the model in an SDF file, and what stands before it."""
_FROM_TEXT = "<literal-string>.sdf"
"""How Drake's messages name a text."""


def process(
    assembly: Assembly, indices: Sequence[int], plant: MultibodyPlant, scene_graph: SceneGraph | None
) -> str:
    """Process some of the directives; return what Drake reported as an error, or an empty text.

    Warnings by which Drake says that it replaced a mass or a size count as errors; all others are passed on
    to Drake's logger. The scene graph receives the geometry, if any is wanted.
    """
    parser = Parser(plant, scene_graph) if scene_graph else Parser(plant)
    parser.package_map().AddMap(_missing(assembly, parser))
    records, file = list[logging.LogRecord](), ""
    try:
        for text, file, directives in _parts([assembly.directives[index] for index in indices]):
            with _warnings() as further:
                if text:
                    parser.AddModelsFromString(text, "sdf")
                elif len(directives) == 1 and (weld := directives[0].add_weld):
                    parent, child = (GetScopedFrameByName(plant, name) for name in (weld.parent, weld.child))
                    offset = weld.X_PC.GetDeterministicValue() if weld.X_PC else RigidTransform()
                    plant.WeldFrames(parent, child, offset)
                else:
                    ProcessModelDirectives(ModelDirectives(directives=directives), parser)
            for record in further:
                record.msg, record.args = record.getMessage().replace(_FROM_TEXT, file), ()
            records += further
    except (RuntimeError, ValueError, SystemExit) as error:  # pydrake exits where Drake's C++ would abort
        return " ".join(str(error).replace(_FROM_TEXT, file).split())
    messages = [" ".join(record.getMessage().split()) for record in records]
    replaced = [message for message in messages if _REPLACED.search(message)]
    if not replaced:
        _pass_on(records)
    return "; ".join(dict.fromkeys(replaced))


def _parts(directives: list[ModelDirective]) -> Iterator[tuple[str, str, list[ModelDirective]]]:
    """Return, in order, SDF files as texts with their paths, and between them what Drake shall process alike.

    Of a text Drake's reader keeps what it knows of the format; for every file it would take 30 ms to read
    that again. Drake welds only what the same call has added, so that welds are parts of their own. Filter
    groups are resolved together: nothing is divided where there are any.
    """
    rest: list[ModelDirective] = []
    divided = not any(directive.add_collision_filter_group for directive in directives)
    for directive in directives:
        text = _sdf_text(directive.add_model) if directive.add_model and divided else ""
        if not text and not (directive.add_weld and divided):
            rest.append(directive)
            continue
        if rest:
            yield "", "", rest
            rest = []
        yield text, directive.add_model.file.removeprefix("file://") if text else "", [directive]
    if rest:
        yield "", "", rest


def _sdf_text(model: AddModel) -> str:
    """Return the text of an SDF file of one model under the directive's name; empty if it needs its place.

    That is so if it includes others, names files by relative paths or starts elsewhere than its zero.
    """
    file = Path(model.file.removeprefix("file://"))
    if file.suffix != ".sdf" or model.default_joint_positions or model.default_free_body_pose:
        return ""
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""
    reserved = model.name == "world" or model.name.startswith("__")
    if reserved or text.count("<model") != 1 or _NEEDS_ITS_PLACE.search(text):
        return ""
    # A function, since a name may hold what a template of re would replace.
    name = quoteattr(model.name)
    named, count = _NAME.subn(lambda found: f"{found[1]}{name}", text)
    return named if count == 1 else ""


def _missing(assembly: Assembly, parser: Parser) -> PackageMap:
    """The scenario's packages without those that the parser knows already."""
    packages = PackageMap(assembly.packages)
    for name in packages.GetPackageNames():
        if parser.package_map().Contains(name):
            packages.Remove(name)
    return packages


@contextmanager
def _warnings() -> Iterator[list[logging.LogRecord]]:
    """Collect Drake's warnings in a block, whether or not its logger is silenced or switched off."""
    records: list[logging.LogRecord] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            records.append(record)

    logger = logging.getLogger("drake")
    ours = {"handlers": [Collector()], "filters": [], "propagate": False, "disabled": False}
    theirs = {name: getattr(logger, name) for name in (*ours, "level")}
    switched_off = logging.root.manager.disable
    vars(logger).update(ours)
    logging.disable(logging.NOTSET)
    logger.setLevel(logging.WARNING)
    try:
        yield records
    finally:
        vars(logger).update(theirs)
        logging.disable(switched_off)  # This also makes Drake notice the level that was put back.


def _pass_on(records: Sequence[logging.LogRecord]) -> None:
    logger = logging.getLogger("drake")
    for record in records:
        if logger.isEnabledFor(record.levelno):
            logger.handle(record)


# Adds models to a plant by directives: without gravity, with one actuator for each joint of q.


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


# Reads the models of a scenario once, however many plants are built from them.


P = ParamSpec("P")
T = TypeVar("T")


def read_once(read: Callable[Concatenate[Scenario, P], T]) -> Callable[Concatenate[Scenario, P], T]:
    """Keep what a function reads from a scenario for as long as the scenario is in use.

    A scenario that is loaded again, or changed by ``dataclasses.replace``, is another one: its files are read
    anew. The function takes a scenario and hashable positional arguments; what it returns must not refer to
    the scenario, and callers must not change it.
    """
    kept: dict[int, dict[Hashable, T]] = {}

    @wraps(read)
    def reading(scenario: Scenario, /, *args: P.args, **kwargs: P.kwargs) -> T:
        if id(scenario) not in kept:
            kept[id(scenario)] = {}
            weakref.finalize(scenario, kept.pop, id(scenario))
        results = kept[id(scenario)]
        if args not in results:
            results[args] = read(scenario, *args, **kwargs)
        return results[args]

    return reading


def add_copy(
    builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph
) -> tuple[MultibodyPlant, SceneGraph]:
    """Add copies of a finalized plant and its scene graph to a diagram, connected to each other.

    Elements of the copy have the same indices as those of the original.
    """
    plant = builder.AddNamedSystem("plant", plant.Clone())
    scene_graph = builder.AddNamedSystem("scene_graph", scene_graph.Clone())
    for output, entry in (
        ("geometry_pose", "plant_pose"),
        ("deformable_body_configuration", "plant_configuration"),
    ):
        builder.Connect(plant.GetOutputPort(output), scene_graph.GetInputPort(entry))
    builder.Connect(scene_graph.get_query_output_port(), plant.get_geometry_query_input_port())
    return plant, scene_graph
