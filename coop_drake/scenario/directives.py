"""Checks model directives, and opens the files of directives that they name.

Drake ends the process on some invalid directives; they are refused here before Drake gets them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pydrake.common.schema import Transform
from pydrake.multibody.parsing import AddModel, AddWeld, ModelDirective, PackageMap

from coop_drake.errors import ScenarioError
from coop_drake.scenario.directive import Directive, DirectiveEntry
from coop_drake.scenario.packages import resolve
from coop_drake.scenario.reading import read_file
from coop_drake.typed_data import DataError

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
        ScenarioError: Naming the key of what Drake cannot read, or would end the process on.
    """
    try:
        directives = tuple(entry.drake for entry in entries)
    except DataError as error:
        raise ScenarioError(file, error.key, error.value, error.allowed) from error
    for entry, directive in zip(entries, directives, strict=True):
        _check(file, entry.key, directive)
    return directives


def _check(file: str, key: str, directive: ModelDirective) -> None:
    """Refuse a directive on which Drake would end the process, or whose values would have no effect.

    Raises:
        ScenarioError: Naming the key inside the directive.
    """
    kinds = [kind for kind in REQUIRED if getattr(directive, kind) is not None]
    if len(kinds) != 1:
        raise ScenarioError(file, key, kinds, "exactly one of " + ", ".join(REQUIRED))
    kind = kinds[0]
    content = getattr(directive, kind)
    for name in REQUIRED[kind]:
        if not getattr(content, name):
            raise ScenarioError(
                file, f"{key}.{kind}.{name}", getattr(content, name), "a value; it is required"
            )
    if directive.add_model:
        _check_model(file, f"{key}.add_model", directive.add_model)
    elif directive.add_weld:
        _check_weld(file, f"{key}.add_weld", directive.add_weld)
    elif directive.add_frame:
        _check_transform(file, f"{key}.add_frame.X_PF", directive.add_frame.X_PF)
    elif directive.add_directives and directive.add_directives.model_namespace:
        namespace = directive.add_directives.model_namespace
        raise ScenarioError(file, f"{key}.add_directives.model_namespace", namespace, "no namespace")


def _check_model(file: str, key: str, model: AddModel) -> None:
    if Path(model.file).suffix not in (".sdf", ".urdf"):
        raise ScenarioError(file, f"{key}.file", model.file, "an .sdf or .urdf file")
    if "::" in model.name:
        raise ScenarioError(file, f"{key}.name", model.name, "a name without ::")
    for name in ("default_free_body_pose", "default_joint_positions"):
        if getattr(model, name):
            value = sorted(getattr(model, name))
            raise ScenarioError(file, f"{key}.{name}", value, "nothing; poses and joints stand under start")


def _check_weld(file: str, key: str, weld: AddWeld) -> None:
    if weld.X_PC is None:
        return
    _check_transform(file, f"{key}.X_PC", weld.X_PC)
    if weld.X_PC.base_frame:
        base = weld.X_PC.base_frame
        raise ScenarioError(
            file, f"{key}.X_PC.base_frame", base, "nothing; the pose is in the weld's parent frame"
        )


def _check_transform(file: str, key: str, transform: Transform) -> None:
    if not transform.IsDeterministic():
        raise ScenarioError(file, key, str(transform), "one pose, not a distribution")


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
