"""What a shell offers when the tabulator key is pressed: scenario files and the gain sets in them."""

from __future__ import annotations

from pathlib import Path

import typer

from coop_drake.shipped import scenario_file, shipped_scenarios

__all__ = ["complete_gains", "complete_scenario"]

_ENDING = ".scenario.yaml"
_SHIPPED_GAINS = ("scheduled", "table_2")


def complete_scenario(incomplete: str) -> list[str]:
    """Shipped scenarios, scenario files, and folders on the way to some, that begin as typed."""
    typed = Path(incomplete)
    folder = typed if incomplete.endswith("/") else typed.parent
    shipped = [name for name in shipped_scenarios() if name.startswith(incomplete)]
    if not folder.is_dir():
        return shipped
    entries = sorted(folder.iterdir())
    names = [f"{entry}/" if entry.is_dir() else str(entry) for entry in entries]
    found = [name for name in names if name.endswith(("/", _ENDING)) and name.startswith(incomplete)]
    return shipped + [name for name in found if not name.rstrip("/").rpartition("/")[2].startswith(".")]


def complete_gains(context: typer.Context, incomplete: str) -> list[str]:
    """Names of the scenario's gain sets that begin as typed."""
    names = set(_SHIPPED_GAINS)
    scenario = context.params.get("scenario")
    if scenario is not None:
        names |= _gain_sets(scenario_file(scenario))
    return sorted(name for name in names if name.startswith(incomplete))


def _gain_sets(path: Path) -> set[str]:
    """Names as they stand in the file; a file that cannot be read offers none."""
    import yaml

    class Loader(yaml.SafeLoader):
        """Reads tags that only Drake's loader knows as plain mappings."""

    Loader.add_multi_constructor("", lambda loader, _, node: loader.construct_mapping(node))
    try:
        sets = yaml.load(path.read_text(encoding="utf-8"), Loader=Loader)["gains"]["sets"]
        return {str(name) for name in sets}
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError):
        return set()
