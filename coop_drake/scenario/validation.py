"""What a scenario must satisfy before any body is known."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from coop_drake.errors import ScenarioError
from coop_drake.scenario.assembly import assemble
from coop_drake.scenario.deployment_checks import check_deployment
from coop_drake.scenario.directives import check_directive
from coop_drake.scenario.model import Scenario
from coop_drake.scenario.rings import check_workspace

_ROUNDING = 1e-9
_COARSEST_MAP = 0.01  # An error of T beyond would turn the direction of motion.
_LONGEST_STEP = 0.01  # Of a discrete plant [s]; forces held for longer are no model of anything.
_MAY_BE_ZERO = frozenset({"planner.margin", "planner.slice_overlap"})


def validate(scenario: Scenario) -> None:
    """Refuse a scenario whose values do not fit together.

    Raises:
        ScenarioError: With file, key, value and what is allowed there.
    """
    file = str(scenario.path)
    check_workspace(scenario)
    for key, value in _positive_numbers(scenario):
        if value < 0.0 or (value == 0.0 and key not in _MAY_BE_ZERO):
            kind = "zero or a positive number" if key in _MAY_BE_ZERO else "a positive number"
            raise ScenarioError(file, key, value, kind)
    if scenario.planner.slice_overlap > 1.0:
        raise ScenarioError(file, "planner.slice_overlap", scenario.planner.slice_overlap, "at most 1")
    if scenario.maps.tolerance >= _COARSEST_MAP:
        raise ScenarioError(file, "maps.tolerance", scenario.maps.tolerance, f"less than {_COARSEST_MAP:g}")
    if scenario.plant.time_step > _LONGEST_STEP:
        raise ScenarioError(file, "plant.time_step", scenario.plant.time_step, f"at most {_LONGEST_STEP:g} s")
    if scenario.simulator.accuracy >= 1.0:
        raise ScenarioError(file, "simulator.accuracy", scenario.simulator.accuracy, "less than 1")
    if scenario.gains.selected not in scenario.gains.sets:
        known = ", ".join(sorted(scenario.gains.sets))
        raise ScenarioError(file, "gains.selected", scenario.gains.selected, f"a gain set, one of {known}")
    for index, directive in enumerate(scenario.directives):
        check_directive(file, f"directives[{index}]", directive)
    check_deployment(scenario)
    robots = [robot.name for robot in assemble(scenario).robots]
    for name in scenario.fixed_joints:
        if name not in robots:
            raise ScenarioError(file, f"fixed_joints.{name}", name, "a robot, one of " + ", ".join(robots))
    _check_load_shares(scenario, robots)


def _check_load_shares(scenario: Scenario, robots: list[str]) -> None:
    file, shares = str(scenario.path), scenario.load_shares
    for name, share in shares.items():
        if name not in robots:
            raise ScenarioError(file, f"load_shares.{name}", name, "a robot, one of " + ", ".join(robots))
        if not 0.0 <= share <= 1.0:
            raise ScenarioError(file, f"load_shares.{name}", share, "a number between 0 and 1")
    if not shares:
        return
    if missing := [name for name in robots if name not in shares]:
        raise ScenarioError(file, f"load_shares.{missing[0]}", None, "a share for every robot, or for none")
    total = sum(shares.values())
    if abs(total - 1.0) > _ROUNDING:
        raise ScenarioError(file, "load_shares", dict(shares), f"shares that sum to 1, not to {total:.10g}")


def _positive_numbers(scenario: Scenario) -> Iterator[tuple[str, float]]:
    """Yield ``(key, value)`` of every setting and tolerance that must not be negative."""
    sections: dict[str, Any] = {
        "goal.tolerances": scenario.goal.tolerances,
        "planner": scenario.planner,
        "maps": scenario.maps,
        "plant": scenario.plant,
        "simulator": scenario.simulator,
        "visualization": scenario.visualization,
    }
    for key, section in sections.items():
        for field in dataclasses.fields(section):
            value = getattr(section, field.name)
            if isinstance(value, int | float) and not isinstance(value, bool):
                yield f"{key}.{field.name}", float(value)
