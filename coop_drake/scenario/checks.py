"""Checks that relate several values of a scenario; the limits of single values stand in their types.

Each check yields the faults that it finds as (key, value, what is allowed), so that all are said at once.
"""

from collections.abc import Iterator, Sequence
from dataclasses import fields

import numpy as np
from shapely import LineString, Polygon, STRtree
from shapely.validation import explain_validity

from coop_drake.errors import ScenarioError
from coop_drake.scenario.deployment import ALL_ROBOTS, JointFriction
from coop_drake.scenario.directives import assemble
from coop_drake.scenario.model import OBJECT, RobotLimits, Scenario, Workspace

Ring = Sequence[tuple[float, float]]
Faults = Iterator[tuple[str, object, str]]

_ROUNDING = 1e-9
"""Load shares may miss the sum 1 by so much: a file writes them in decimals [-]."""

_LEAST_AREA = 1e-9
"""Rings with a smaller area are degenerate [m^2]."""

_SAMPLED = ("sample_offset", "switch_delay", "silence", "deaf")
"""Departures of single robots that need a control rate."""

_LIMITS_OF_ROBOTS = tuple(key.name for key in fields(RobotLimits) if key.name != "acceleration")
"""Keys of an entry of ``limits`` that is a robot's."""


def validate(scenario: Scenario) -> None:
    """Refuse a scenario whose values do not fit together.

    Raises:
        ScenarioError: With file, key, value and what is allowed there.
    """
    faults = [*_ring_faults(scenario.workspace), *_setting_faults(scenario)]
    try:
        robots = [robot.name for robot in assemble(scenario).robots]
        faults += [*_name_faults(scenario, robots), *_deployment_faults(scenario)]
    except ScenarioError as error:
        if error.file != str(scenario.path) or not faults:
            raise
        faults += [(error.key, error.value, error.allowed), *error.others]
    if faults:
        raise ScenarioError.of(str(scenario.path), faults)


def _setting_faults(scenario: Scenario) -> Faults:
    passes, known = scenario.passes, ", ".join(sorted(scenario.gains.sets))
    if not passes and scenario.gains.selected not in scenario.gains.sets:
        allowed = f"a gain set, one of {known}; null for a team that passes from cell to cell"
        yield "gains.selected", scenario.gains.selected, allowed
    if not passes and scenario.deployment.budget != "none":
        allowed = "none; the plan of a team that passes from cell to cell (gains.selected: null) may have one"
        yield "deployment.budget", scenario.deployment.budget, allowed
    hold = scenario.control.hold
    if hold is not None and passes:
        for key in ("energy", "silence"):
            if (stated := getattr(hold, key)) is not None:
                yield (
                    f"control.hold.{key}",
                    stated,
                    "null for a team that passes from cell to cell; with gains.selected it may be stated",
                )
    if hold is not None and hold.silence is not None and scenario.deployment.control_rate is None:
        yield "control.hold.silence", hold.silence, "null without deployment.control_rate"


def _name_faults(scenario: Scenario, robots: Sequence[str]) -> Faults:
    """Yield names of robots and bodies that the team does not have, and load shares that do not add up."""
    for section in ("fixed_joints", "load_shares", "limits"):
        for name in getattr(scenario, section):
            if name not in robots and (section != "limits" or name not in (ALL_ROBOTS, OBJECT)):
                yield f"{section}.{name}", name, "a robot, one of " + ", ".join(robots)
    if OBJECT in robots and OBJECT in scenario.limits:
        yield "robots", OBJECT, f"another name: limits.{OBJECT} has the limits of the object"
    for name, stated in scenario.limits.items():
        if name != OBJECT and stated.acceleration is not None:
            yield (
                f"limits.{name}.acceleration",
                stated.acceleration,
                f"null; only limits.{OBJECT} has this key",
            )
        for key in _LIMITS_OF_ROBOTS if name == OBJECT else ():
            if (value := getattr(stated, key)) != getattr(RobotLimits(), key):
                yield f"limits.{name}.{key}", value, "nothing; only the limit acceleration is of the object"
    for name in scenario.deployment.robots:
        if name not in (*robots, ALL_ROBOTS):
            known = f'a robot, one of {", ".join(robots)}, or "{ALL_ROBOTS}"'
            yield f"deployment.robots.{name}", name, known
    for i, push in enumerate(scenario.deployment.pushes):
        if push.body not in (scenario.object, *robots):
            yield f"deployment.pushes[{i}].body", push.body, "one of " + ", ".join((scenario.object, *robots))
    shares = scenario.load_shares
    missing = [name for name in robots if shares and name not in shares]
    for name in missing:
        yield f"load_shares.{name}", None, "a share for every robot, or for none"
    total = sum(shares.values())
    if shares and not missing and abs(total - 1.0) > _ROUNDING:
        yield "load_shares", dict(shares), f"shares that sum to 1, not to {total:.10g}"


def _deployment_faults(scenario: Scenario) -> Faults:
    for key, value, allowed in (*_rate_faults(scenario), *_size_faults(scenario)):
        yield f"deployment.{key}", value, allowed


def _rate_faults(scenario: Scenario) -> Faults:
    """Yield what a team in continuous time cannot have: it has no samples and no messages."""
    deployment = scenario.deployment
    if deployment.control_rate is not None:
        return
    for section in ("measurements", "messages"):
        values = getattr(deployment, section)
        for name, value in ((one.name, getattr(values, one.name)) for one in fields(values)):
            if value:
                yield f"{section}.{name}", value, "0 without deployment.control_rate"
    if deployment.clock_error:
        yield "clock_error", deployment.clock_error, "0 without deployment.control_rate"
    if deployment.budget != "none":
        yield "budget", deployment.budget, "none without deployment.control_rate"
    for robot, departures in deployment.robots.items():
        for name in _SAMPLED:
            if value := getattr(departures, name):
                yield f"robots.{robot}.{name}", value, "0 or null without deployment.control_rate"


def _size_faults(scenario: Scenario) -> Faults:
    """Yield times that do not fit the control period or the steps of the simulation."""
    deployment, step = scenario.deployment, scenario.simulator.max_step_size
    for robot, departures in deployment.robots.items():
        if deployment.period is not None and not departures.sample_offset < deployment.period:
            allowed = f"a time shorter than the control period of {deployment.period:g} s"
            yield f"robots.{robot}.sample_offset", departures.sample_offset, allowed
        if departures.blocked is not None and not scenario.plant.ideal:
            allowed = "null with plant.grasps: constraints: blocked wheels are simulated in one tree alone"
            yield f"robots.{robot}.blocked", departures.blocked, allowed
    if deployment.joint_friction != JointFriction() and not scenario.plant.ideal:
        allowed = "none with plant.grasps: constraints: friction that sticks is simulated in one tree alone"
        yield "joint_friction", deployment.joint_friction, allowed
    for i, push in enumerate(deployment.pushes):
        if push.duration < step:
            allowed = f"at least simulator.max_step_size, {step:g} s: a step might miss a shorter one"
            yield f"pushes[{i}].duration", push.duration, allowed
    lag, plant = deployment.actuators.lag, scenario.plant
    if not plant.ideal and 0.0 < lag < plant.time_step:
        yield "actuators.lag", lag, f"0 or at least plant.time_step, {plant.time_step:g} s"


def _ring_faults(workspace: Workspace) -> Faults:
    """Yield rings that cross themselves or each other, and holes that are not inside and apart."""
    rings = {"workspace.outer": workspace.outer}
    rings |= {f"workspace.holes[{index}]": ring for index, ring in enumerate(workspace.holes)}
    wrong = [fault for key, ring in rings.items() for fault in _faults_of_ring(key, ring)]
    if wrong:
        yield from wrong
        return
    floor = Polygon(workspace.outer)
    holes: list[Polygon] = []
    for index, ring in enumerate(workspace.holes):
        key, hole = f"workspace.holes[{index}]", Polygon(ring)
        if not floor.contains(hole):
            where = "across" if floor.intersects(hole) else "outside"
            yield key, _plain(ring), f"a hole inside workspace.outer, not {where} it"
            return
        for other, earlier in enumerate(holes):
            if not hole.disjoint(earlier) and not hole.touches(earlier):
                yield key, _plain(ring), f"a hole apart from workspace.holes[{other}]"
                return
        holes.append(hole)
    if not workspace.polygon.is_valid:
        reason = explain_validity(workspace.polygon)
        yield "workspace", reason, "holes that leave the floor in one piece"


def _faults_of_ring(key: str, ring: Ring) -> Faults:
    if len({tuple(corner) for corner in ring}) < 3:
        yield key, _plain(ring), "three or more different corners"
        return
    polygon = Polygon(ring)
    if polygon.is_valid and polygon.area < _LEAST_AREA:
        yield key, _plain(ring), f"a ring with an area of {_LEAST_AREA:g} m^2 or more"
    elif not polygon.is_valid:
        first, second, place = _meeting_edges(ring)
        allowed = (
            f"a ring that does not cross or touch itself (the edges that leave corners {first} and {second} "
            f"meet at ({place[0]:g}, {place[1]:g}))"
        )
        yield f"{key}[{first}]", list(ring[first]), allowed


def _meeting_edges(ring: Ring) -> tuple[int, int, tuple[float, float]]:
    """Return the first two edges that meet elsewhere than at a common corner, and where they meet."""
    corners = [index for index in range(len(ring)) if tuple(ring[index]) != tuple(ring[index - 1])]
    ends = zip(corners, corners[1:] + corners[:1], strict=True)
    edges = [LineString([ring[a], ring[b]]) for a, b in ends]
    pairs = STRtree(edges).query(edges, predicate="intersects")
    for first, second in sorted(zip(*pairs.tolist(), strict=True)):
        if first >= second:
            continue
        common = edges[first].intersection(edges[second])
        neighbours = second - first in (1, len(edges) - 1)
        if not (neighbours and common.geom_type == "Point"):
            x, y = np.array(common.representative_point().coords)[0]
            return corners[first], corners[second], (float(x), float(y))
    raise AssertionError("a ring whose edges do not meet is valid")


def _plain(ring: Ring) -> list[list[float]]:
    return [list(corner) for corner in ring]
