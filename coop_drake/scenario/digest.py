"""Digest of a scenario: which scenario a log belongs to."""

from coop_drake.answers.digest import content_digest
from coop_drake.scenario.model import Scenario
from coop_drake.typed_data import to_plain

_NOT_IN_A_RUN = ("planner", "gains", "maps", "visualization")
"""Sections that change a run only through its plan, or not at all."""


def scenario_digest(scenario: Scenario) -> str:
    """Return the SHA-256 over all that a run takes from its scenario besides the plan, in hexadecimal."""
    content = to_plain(scenario, Scenario)
    return content_digest({key: value for key, value in content.items() if key not in _NOT_IN_A_RUN})
