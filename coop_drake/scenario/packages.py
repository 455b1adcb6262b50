"""Where models are found: package.xml files round the scenario file, and paths relative to it."""

from pathlib import Path

from pydrake.multibody.parsing import PackageMap

from coop_drake.errors import ScenarioError
from coop_drake.shipped import SHIPPED


def package_map(scenario_path: Path) -> PackageMap:
    """Collect the packages that a scenario may name in ``package://`` addresses.

    They are those of every ``package.xml`` beside the scenario file or in a folder above it, the nearest
    first, then coop_drake's own models, then what Drake knows by itself.

    Args:
        scenario_path: The scenario file.

    Raises:
        ScenarioError: A package.xml does not name its package.
    """
    packages = PackageMap()
    folders = scenario_path.resolve().parents
    for file in reversed([folder / "package.xml" for folder in (*folders, SHIPPED)]):
        if file.is_file():
            _add(packages, file)
    return packages


def _add(packages: PackageMap, file: Path) -> None:
    """Add a package in place of any other of its name."""
    single = PackageMap.MakeEmpty()
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
    """Turn the file of a directive into an address that Drake can open.

    Args:
        file: ``package://name/path``, ``file:///path``, or a path relative to the file it stands in.
        beside: The file it stands in.
        packages: The packages at hand.
        scenario_file: The scenario, for messages.
        key: Where ``file`` stands in the scenario.

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
