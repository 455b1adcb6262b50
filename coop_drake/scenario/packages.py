"""Finds model files: in packages around the scenario file, or by paths relative to it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from coop_drake.errors import ScenarioError
from coop_drake.shipped import SHIPPED

if TYPE_CHECKING:
    from pydrake.multibody.parsing import PackageMap


def package_map(scenario_path: Path) -> PackageMap:
    """Collect the packages that a scenario file may name in ``package://`` addresses.

    A name is looked up in every ``package.xml`` beside the file or in a folder above it, the nearest first,
    then in coop_drake's own models, then in Drake's.

    Raises:
        ScenarioError: A package.xml does not name its package.
    """
    from pydrake.multibody.parsing import PackageMap

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
