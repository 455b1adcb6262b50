"""Files that hold one gain set: the ``gains`` section of a scenario, as ``coop-drake tune`` writes it."""

from dataclasses import replace
from pathlib import Path

from coop_drake.errors import ScenarioError
from coop_drake.laws.gains import GainSet
from coop_drake.scenario.document import write
from coop_drake.scenario.model import Gains, Scenario
from coop_drake.scenario.reading import read_file
from coop_drake.typed_data import to_plain


def with_gains(scenario: Scenario, choice: str | None) -> Scenario:
    """Return the scenario with a gain set selected.

    Args:
        scenario: The scenario.
        choice: Name of one of its gain sets, or a file with a ``gains`` section; None leaves the selection.

    Raises:
        ScenarioError: There is no such set and no such file, or the file is wrong.
    """
    if choice is None:
        return scenario
    if choice in scenario.gains.sets:
        return replace(scenario, gains=replace(scenario.gains, selected=choice))
    if not Path(choice).is_file():
        allowed = f"one of {', '.join(sorted(scenario.gains.sets))}, or a file with a gain set"
        raise ScenarioError(str(scenario.path), "--gains", choice, allowed)
    read: Gains = read_file(Gains, Path(choice))
    if read.selected not in read.sets:
        raise ScenarioError(choice, "selected", read.selected, "one of " + ", ".join(sorted(read.sets)))
    return replace(scenario, gains=replace(read, sets={**scenario.gains.sets, **read.sets}))


def dump_gains(name: str, gain_set: GainSet) -> str:
    """Write a gain set as YAML text that ``--gains`` reads, and that fits a scenario under ``gains``."""
    return write({"selected": name, "sets": {name: to_plain(gain_set, GainSet)}})
