"""What a scenario must satisfy before any body is known."""

from coop_drake.scenario.model import Scenario


def validate(scenario: Scenario) -> None:
    """Refuse a scenario whose values do not fit together."""
