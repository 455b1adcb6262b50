"""Model directives as Drake's types, and the files that they name.

Drake ends the process on some invalid directives; they are refused here before Drake gets them. Their parts
are built from their fields, because Drake's YAML loader names no key where a value is wrong; poses and other
values whose types have many forms are left to that loader.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin

import numpy as np
from pydrake.common.yaml import yaml_dump, yaml_dump_typed, yaml_load_typed
from pydrake.multibody import parsing
from pydrake.multibody.parsing import AddModel, AddWeld, ModelDirective, PackageMap

from coop_drake.errors import ScenarioError
from coop_drake.scenario.document import parse, read_file
from coop_drake.scenario.model import Directive, DirectiveEntry
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
