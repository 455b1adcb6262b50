"""Checks that relate several values of a scenario; the limits of single values stand in their types."""

from coop_drake.errors import ScenarioError
from coop_drake.scenario.assembly import assemble
from coop_drake.scenario.deployment_checks import check_deployment
from coop_drake.scenario.limits import ALL_ROBOTS
from coop_drake.scenario.model import Scenario
from coop_drake.scenario.rings import check_workspace

_ROUNDING = 1e-9
"""Load shares may miss the sum 1 by so much: a file writes them in decimals [-]."""


def validate(scenario: Scenario) -> None:
    """Refuse a scenario whose values do not fit together.

    Raises:
        ScenarioError: With file, key, value and what is allowed there.
    """
    file = str(scenario.path)
    check_workspace(scenario)
    if scenario.gains.selected not in scenario.gains.sets:
        known = ", ".join(sorted(scenario.gains.sets))
        raise ScenarioError(file, "gains.selected", scenario.gains.selected, f"a gain set, one of {known}")
    robots = [robot.name for robot in assemble(scenario).robots]
    check_deployment(scenario, robots)
    hold = scenario.control.hold
    if hold is not None and hold.silence is not None and scenario.deployment.control_rate is None:
        raise ScenarioError(
            file, "control.hold.silence", hold.silence, "null without deployment.control_rate"
        )
    for section in ("fixed_joints", "load_shares", "limits"):
        for name in getattr(scenario, section):
            if name not in robots and (section, name) != ("limits", ALL_ROBOTS):
                raise ScenarioError(file, f"{section}.{name}", name, "a robot, one of " + ", ".join(robots))
    _check_load_shares(scenario, robots)


def _check_load_shares(scenario: Scenario, robots: list[str]) -> None:
    file, shares = str(scenario.path), scenario.load_shares
    if not shares:
        return
    if missing := [name for name in robots if name not in shares]:
        raise ScenarioError(file, f"load_shares.{missing[0]}", None, "a share for every robot, or for none")
    total = sum(shares.values())
    if abs(total - 1.0) > _ROUNDING:
        raise ScenarioError(file, "load_shares", dict(shares), f"shares that sum to 1, not to {total:.10g}")
