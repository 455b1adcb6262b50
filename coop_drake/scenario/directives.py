"""Model directives as Drake's types, the files that they name, and the team that they assemble.

Drake ends the process on some invalid directives; they are refused here before Drake gets them. Their parts
are built from their fields, because Drake's YAML loader names no key where a value is wrong; poses and other
values whose types have many forms are left to that loader.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

import numpy as np
from pydrake.common.schema import Transform
from pydrake.common.yaml import yaml_dump, yaml_dump_typed, yaml_load_typed
from pydrake.math import RigidTransform
from pydrake.multibody import parsing
from pydrake.multibody.parsing import AddModel, AddWeld, ModelDirective, PackageMap

from coop_drake.errors import ScenarioError
from coop_drake.scenario.document import parse, read_file
from coop_drake.scenario.model import Directive, DirectiveEntry, Scenario
from coop_drake.shipped import SHIPPED
from coop_drake.typed_data import DataError, Real, below, convert

REQUIRED = {
    "add_model": ("name", "file"),
    "add_model_instance": ("name",),
    "add_frame": ("name",),
    "add_weld": ("parent", "child"),
    "add_collision_filter_group": ("name", "members"),
    "add_directives": ("file",),
}
"""Entries that a directive of each kind must have."""


@dataclass(frozen=True)
class DirectivesFile:
    """A file of model directives, usually ``NAME.dmd.yaml``.

    Attributes:
        directives: The directives, in the order in which Drake applies them.
    """

    directives: tuple[Directive, ...]


def checked_directives(file: str, entries: tuple[DirectiveEntry, ...]) -> tuple[ModelDirective, ...]:
    """Return the directives of a file as Drake's type.

    Raises:
        ScenarioError: Naming the keys of what Drake cannot read, or would end the process on.
    """
    found: list[ModelDirective] = []
    wrong: list[Any] = []
    for index, entry in enumerate(entries):
        key = f"directives[{index}]"
        try:
            found.append(entry.drake)
            wrong += [(below(key, place), *fault) for place, *fault in _faults(entry.drake)]
        except DataError as error:
            wrong += error.below(key).faults
    if wrong:
        raise ScenarioError.of(file, wrong)
    return tuple(found)


def _faults(directive: ModelDirective) -> Iterator[tuple[str, object, str]]:
    """Yield key, value and what is allowed where Drake would end the process, or values had no effect."""
    kinds = [kind for kind in REQUIRED if getattr(directive, kind) is not None]
    if len(kinds) != 1:
        yield "", kinds, "exactly one of " + ", ".join(REQUIRED)
        return
    kind = kinds[0]
    content = getattr(directive, kind)
    missing = [name for name in REQUIRED[kind] if not getattr(content, name)]
    for name in missing:
        yield f"{kind}.{name}", getattr(content, name), "a value; it is required"
    if missing:
        return
    if directive.add_model:
        yield from _model_faults(directive.add_model)
    elif directive.add_weld:
        yield from _weld_faults(directive.add_weld)
    elif directive.add_frame and not directive.add_frame.X_PF.IsDeterministic():
        yield "add_frame.X_PF", str(directive.add_frame.X_PF), _ONE_POSE
    elif directive.add_directives and directive.add_directives.model_namespace:
        yield "add_directives.model_namespace", directive.add_directives.model_namespace, "no namespace"


def _model_faults(model: AddModel) -> Iterator[tuple[str, object, str]]:
    if Path(model.file).suffix not in (".sdf", ".urdf"):
        yield "add_model.file", model.file, "an .sdf or .urdf file"
    if "::" in model.name:
        yield "add_model.name", model.name, "a name without ::"
    for name in ("default_free_body_pose", "default_joint_positions"):
        if getattr(model, name):
            value = sorted(getattr(model, name))
            yield f"add_model.{name}", value, "nothing; poses and joints stand under start"


def _weld_faults(weld: AddWeld) -> Iterator[tuple[str, object, str]]:
    pose = weld.X_PC
    if pose is not None and not pose.IsDeterministic():
        yield "add_weld.X_PC", str(pose), _ONE_POSE
    if pose is not None and pose.base_frame:
        yield "add_weld.X_PC.base_frame", pose.base_frame, "nothing; the pose is in the weld's parent frame"


_ONE_POSE = "one pose, not a distribution"


def flat(
    directives: tuple[ModelDirective, ...],
    trail: tuple[Path, ...],
    packages: PackageMap,
    file: str,
    key: str,
) -> Iterator[tuple[str, ModelDirective]]:
    """Yield ``(key, directive)``, with nested files opened and file addresses resolved.

    Args:
        directives: Checked directives.
        trail: The file that holds them, last, after those that lead to it; paths are relative to its folder.
        packages: Folders of the packages that ``package://`` addresses name.
        file: The scenario file, for messages.
        key: Key of the directives in the scenario file.

    Raises:
        ScenarioError: A file is missing, is wrong, or includes itself.
    """
    for index, directive in enumerate(directives):
        here = f"{key}[{index}]"
        if directive.add_model:
            model = directive.add_model.__copy__()
            model.file = resolve(model.file, trail[-1], packages, file, f"{here}.add_model.file")
            yield here, ModelDirective(add_model=model)
        elif directive.add_directives:
            name = directive.add_directives.file
            nested_key = f"{here}.add_directives.file"
            opened = Path(resolve(name, trail[-1], packages, file, nested_key).removeprefix("file://"))
            if opened in trail:
                raise ScenarioError(file, nested_key, name, "a file that does not include itself")
            inner = checked_directives(str(opened), read_file(DirectivesFile, opened).directives)
            yield from flat(inner, (*trail, opened), packages, file, f"{here}.add_directives")
        else:
            yield here, directive


def read_directive(value: object, key: str) -> parsing.ModelDirective:
    """Read a model directive from plain data that stands at ``key``.

    Raises:
        DataError: The first departure; a number in it that is not finite or too large is one.
    """
    return _read(value, parsing.ModelDirective, key)


def write_directive(directive: parsing.ModelDirective) -> object:
    """Return a model directive as plain data."""
    return parse(yaml_dump_typed(directive))


def _read(value: object, kind: Any, key: str) -> Any:
    """Read a value of one of Drake's types."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType) and type(None) in arguments:
        return None if value is None else _read(value, arguments[0], key)
    if kind is str:
        return convert(value, str, key)
    if kind == list[str]:
        return list(convert(value, tuple[str, ...], key))
    if kind is np.ndarray:
        return np.array(convert(value, tuple[float, ...], key))
    if origin is dict:
        items = convert(value, dict[str, Any], key).items()
        return {name: _read(item, arguments[1], below(key, name)) for name, item in items}
    if not hasattr(kind, "__fields__"):
        return _read_by_drake(value, kind, key)
    fields = {field.name: field.type for field in kind.__fields__}
    names = ", ".join(fields)
    if not isinstance(value, dict):
        raise DataError(key, value, f"a mapping with keys among {names}")
    for name in value:
        if name == "_tag":
            raise DataError(key, value[name], "a mapping without a tag")
        if name not in fields:
            raise DataError(below(key, name), value[name], f"one of the keys {names}")
    if kind.__module__ != parsing.__name__:
        return _read_by_drake(value, kind, key)
    return kind(**{name: _read(item, fields[name], below(key, name)) for name, item in value.items()})


def _read_by_drake(value: object, kind: Any, key: str) -> Any:
    """Let Drake's YAML loader read a value whose numbers are finite and not too large."""
    _check_numbers(value, key)
    try:
        return yaml_load_typed(schema=kind, data=yaml_dump(value))
    except (AssertionError, AttributeError, RuntimeError, TypeError, ValueError) as error:
        reason = "a vector of the wrong size" if "incompatible function" in str(error) else str(error)
        name = getattr(kind, "__name__", "value")
        raise DataError(key, value, f"a {name} as Drake reads it ({' '.join(reason.split())})") from error


def _check_numbers(value: object, key: str) -> None:
    """Refuse numbers that are not finite or too large; YAML 1.1 takes some of them for texts."""
    if isinstance(value, list):
        for index, item in enumerate(value):
            _check_numbers(item, f"{key}[{index}]")
    elif isinstance(value, dict):
        for name, item in value.items():
            _check_numbers(item, below(key, name))
    elif _is_number(value):
        convert(float(str(value)), Real, key)


def _is_number(value: object) -> bool:
    """Whether Drake would read a number."""
    try:
        float(value)  # type: ignore[arg-type]
    except OverflowError:
        return True
    except (TypeError, ValueError):
        return False
    return not isinstance(value, bool)


def package_map(scenario_path: Path) -> PackageMap:
    """Collect the packages that a scenario file may name in ``package://`` addresses.

    A name is looked up in every ``package.xml`` beside the file or in a folder above it, the nearest first,
    then in coop_drake's own models, then in Drake's.

    Raises:
        ScenarioError: A package.xml does not name its package.
    """
    packages = PackageMap()
    for folder in (SHIPPED, *reversed(scenario_path.resolve().parents)):
        if (folder / "package.xml").is_file():
            _add(packages, folder / "package.xml")
    return packages


def _add(packages: PackageMap, file: Path) -> None:
    """Add a package, and remove another one of its name."""
    single = type(packages).MakeEmpty()
    try:
        single.AddPackageXml(file)
    except RuntimeError as error:
        raise ScenarioError(
            str(file), "package.name", None, "a package.xml that names its package"
        ) from error
    for name in single.GetPackageNames():
        if packages.Contains(name):
            packages.Remove(name)
    packages.AddMap(single)


def resolve(file: str, beside: Path, packages: PackageMap, scenario_file: str, key: str) -> str:
    """Return the file of a directive as an address that Drake can open.

    Args:
        file: ``package://name/path``, ``file:///path``, or a path relative to the folder of ``beside``.
        beside: The file that names it.
        packages: Folders of the packages that may be named.
        scenario_file: The scenario file, for messages.
        key: Key of ``file`` in the scenario file.

    Returns:
        A ``file://`` address of a file that exists.

    Raises:
        ScenarioError: The package is not known, or there is no such file.
    """
    if file.startswith("package://"):
        name, _, inside = file.removeprefix("package://").partition("/")
        if not packages.Contains(name):
            known = ", ".join(sorted(packages.GetPackageNames()))
            raise ScenarioError(scenario_file, key, file, f"a package among {known}")
        path = Path(packages.GetPath(name)) / inside
    elif file.startswith("file://"):
        path = Path(file.removeprefix("file://"))
    else:
        path = beside.resolve().parent / file
    if not path.is_file():
        raise ScenarioError(scenario_file, key, file, f"a file that exists (looked for {path})")
    return f"file://{path.resolve()}"


# The object, the robots and the grasps in the model directives of a scenario.

_LONGEST = 80
_LETTERS = "letters, digits, blanks and _ . : + -, with a letter, digit or _ in front"
_NAME = re.compile(rf"\w[\w.:+ -]{{0,{_LONGEST - 1}}}")
"""Names of models: pictures of a robot bear its name, so that it must be part of a file's name, too."""


@dataclass(frozen=True)
class RobotAssembly:
    """One robot: one model, or several that are welded together.

    Attributes:
        name: Name of the model that the base belongs to; also the robot's name.
        models: Names of its models, in the order of the directives.
        object_frame: Scoped name of the frame on the object where the grasp's weld begins.
        gripper_frame: Scoped name of the frame on the robot where it ends.
        key: Key of the robot's model in the scenario file.
    """

    name: str
    models: tuple[str, ...]
    object_frame: str
    gripper_frame: str
    key: str


@dataclass(frozen=True)
class Assembly:
    """The team as the directives describe it.

    Attributes:
        packages: Folders of the packages that ``package://`` addresses name.
        directives: All directives, nested files opened and file addresses resolved.
        keys: Key of each of them in the scenario file.
        object_model: Name of the object's model.
        robots: The robots in the order of their base models in the directives.
        owners: For each directive the models that it adds or connects.
    """

    packages: PackageMap
    directives: tuple[ModelDirective, ...]
    keys: tuple[str, ...]
    object_model: str
    robots: tuple[RobotAssembly, ...]
    owners: tuple[frozenset[str], ...]

    def of_robot(self, index: int) -> tuple[int, ...]:
        """Indices of the directives that add one robot alone, without its grasp."""
        models = frozenset(self.robots[index].models)
        return tuple(number for number, owners in enumerate(self.owners) if owners and owners <= models)


def assemble(scenario: Scenario) -> Assembly:
    """Read the team's structure from the scenario's directives.

    Raises:
        ScenarioError: A model or frame is not known, a file is missing, there are fewer than two robots, a
            robot has no grasp or two, or a body is welded to the world.
    """
    return _Reader(scenario).assembly()


class _Reader:
    """Reads the directives of one scenario; its file and keys are for messages."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.file = str(scenario.path)
        self.packages = package_map(scenario.path)
        directives = checked_directives(self.file, scenario.directives)
        entries = list(flat(directives, (scenario.path,), self.packages, self.file, "directives"))
        self.keys = tuple(key for key, _ in entries)
        self.directives = tuple(directive for _, directive in entries)
        self.models: dict[str, str] = {}
        self.frames: dict[str, str] = {}
        self._read_names()

    def _refuse(self, key: str, value: object, allowed: str) -> ScenarioError:
        return ScenarioError(self.file, key, value, allowed)

    def _read_names(self) -> None:
        for key, directive in zip(self.keys, self.directives, strict=True):
            if directive.add_model:
                name = directive.add_model.name
                if not _NAME.fullmatch(name):
                    raise self._refuse(f"{key}.add_model.name", name, f"at most {_LONGEST} of {_LETTERS}")
                if name in self.models:
                    raise self._refuse(f"{key}.add_model.name", name, "a name that no other model has")
                self.models[name] = key
            elif directive.add_frame:
                base = directive.add_frame.X_PF.base_frame or ""
                self.frames[directive.add_frame.name] = self._owner(base, f"{key}.add_frame.X_PF.base_frame")

    def _owner(self, frame: str, key: str) -> str:
        """Return the name of the model that a scoped frame belongs to."""
        if frame in self.frames:
            return self.frames[frame]
        scope = frame
        while "::" in scope:
            scope = scope.rpartition("::")[0]
            if scope in self.models:
                return scope
        known = ", ".join(self.models)
        raise self._refuse(key, frame, f"model::frame with a model added before, one of {known}")

    def _weld_owners(self, weld: AddWeld, key: str) -> tuple[str, str]:
        parent = self._owner(weld.parent, f"{key}.add_weld.parent")
        child = self._owner(weld.child, f"{key}.add_weld.child")
        if parent == child:
            raise self._refuse(f"{key}.add_weld.child", weld.child, f"a frame of another model than {parent}")
        return parent, child

    def assembly(self) -> Assembly:
        """Group the models into robots and find the grasps."""
        object_model = self.scenario.object
        if not self.models:
            raise self._refuse("directives", [], "add_model for the object and for two or more robots")
        if object_model not in self.models:
            raise self._refuse(
                "object", object_model, "the name of a model, one of " + ", ".join(self.models)
            )
        self._turn_grasps(object_model)
        welds = [
            (key, d.add_weld, *self._weld_owners(d.add_weld, key))
            for key, d in zip(self.keys, self.directives, strict=True)
            if d.add_weld
        ]
        groups = self._groups(object_model, [(parent, child) for _, _, parent, child in welds])
        robots = [self._robot(group, object_model, welds) for group in groups]
        if len(robots) < 2:
            raise self._refuse("directives", [r.name for r in robots], "two or more robots beside the object")
        return Assembly(
            self.packages,
            self.directives,
            self.keys,
            object_model,
            self._in_order(robots),
            self._all_owners(),
        )

    def _turn_grasps(self, object_model: str) -> None:
        """Make the object the parent of every grasp's weld: then all grasp wrenches have the same sign."""
        turned = []
        for key, directive in zip(self.keys, self.directives, strict=True):
            weld = directive.add_weld
            if weld and self._weld_owners(weld, key)[1] == object_model:
                X_PC = RigidTransform() if weld.X_PC is None else weld.X_PC.GetDeterministicValue()
                turned.append(
                    ModelDirective(
                        add_weld=AddWeld(parent=weld.child, child=weld.parent, X_PC=Transform(X_PC.inverse()))
                    )
                )
            else:
                turned.append(directive)
        self.directives = tuple(turned)

    def _in_order(self, robots: list[RobotAssembly]) -> tuple[RobotAssembly, ...]:
        order = list(self.models)
        return tuple(sorted(robots, key=lambda robot: order.index(robot.name)))

    def _groups(self, object_model: str, edges: list[tuple[str, str]]) -> list[tuple[str, ...]]:
        """Return the groups of models that welds connect when the object is left out."""
        group = {name: name for name in self.models if name != object_model}
        for parent, child in edges:
            if object_model not in (parent, child):
                old, new = group[child], group[parent]
                group = {name: new if root == old else root for name, root in group.items()}
        return [tuple(n for n in group if group[n] == root) for root in dict.fromkeys(group.values())]

    def _robot(
        self, models: tuple[str, ...], object_model: str, welds: list[tuple[str, AddWeld, str, str]]
    ) -> RobotAssembly:
        inner = {child for _, _, parent, child in welds if parent in models and child in models}
        bases = [name for name in models if name not in inner]
        name = bases[0] if bases else models[0]
        if len(bases) != 1:
            raise self._refuse(
                self.models[name],
                list(models),
                "welds that form a tree from one base model; each parent is listed before its child",
            )
        grasps = [weld for _, weld, parent, child in welds if parent == object_model and child in models]
        if len(grasps) != 1:
            raise self._refuse(
                f"{self.models[name]}.add_model.name",
                name,
                f"a robot with exactly one add_weld to a frame of {object_model} (found {len(grasps)})",
            )
        return RobotAssembly(name, models, grasps[0].parent, grasps[0].child, self.models[name])

    def _all_owners(self) -> tuple[frozenset[str], ...]:
        owners = []
        for key, directive in zip(self.keys, self.directives, strict=True):
            if directive.add_model:
                owners.append(frozenset({directive.add_model.name}))
            elif directive.add_frame:
                owners.append(frozenset({self.frames[directive.add_frame.name]}))
            elif directive.add_weld:
                owners.append(frozenset(self._weld_owners(directive.add_weld, key)))
            else:
                owners.append(frozenset())
        return tuple(owners)
