"""Check that a plan tolerates the budget that it states: every stated set follows from those before it.

The plan carries sets of states, gains and regions; this module checks inequalities about them. By induction
over the transitions: from the stated entry set of each, no nominal motion is accelerated more than stated; if
it departs by no more than stated from the middle of its closed funnel, it does so at the next sample, too; it
ends where it counts as arrived; and the states in which the next cell can then be entered lie in the stated
set of that. No disturbance within the budget takes an axis farther from its nominal motion than stated, and
so no nearer to its funnel's bounds; nor the object's origin from its own, which stays in a region inside
the cell. What follows in one step is computed in ``coop_drake/robustness``, which the planner uses, too.
"""

from __future__ import annotations

import numpy as np
import shapely
from shapely import LineString, Point

from coop_drake.answers.budget import LIMITS, Alarms, AxisTracking, Budget, PositionTube, Tolerance
from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.laws.axis_table import RATE_LIMIT, axis_table
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.readiness import EROSION, RATE_TOLERANCE
from coop_drake.robustness.alarms import (
    AxisRoom,
    alarms_of,
    axis_room,
    leaving_since,
    may_miss,
    of_stage,
    position_room,
    rate_noises,
    room_at_entry,
    rubbed,
)
from coop_drake.robustness.axis_departure import (
    HORIZON,
    AxisLoop,
    Departures,
    at_rest,
    axis_loop,
    departing,
    moving_evenly,
    resting_axes,
)
from coop_drake.robustness.couplings import (
    QUICKEST,
    TeamCouplings,
    friction_pushes,
    team_couplings,
    uncoupled,
)
from coop_drake.robustness.efforts import (
    LimitedEfforts,
    even_efforts,
    nothing_commanded,
    single_noise,
    transition_efforts,
)
from coop_drake.robustness.funnel_law import LAW
from coop_drake.robustness.nominal_axes import (
    AxisConditions,
    AxisSets,
    Entry,
    axis_sets,
    comes_near_limit,
    first_leaving,
    next_entry,
)
from coop_drake.robustness.position import PositionGains, position_bounds, position_may_rest
from coop_drake.tree import ComponentTree
from coop_drake.tree.arrays import FloatArray
from coop_drake.verification.checks import Check

ROUNDING, LEAST = 1e-9, 1e-12
"""Differences that rounding explains, relative [-] and absolute [rad or m, and per second]."""


def check_budget(plan: Plan, tree: ComponentTree | None = None) -> Check | None:
    """Check what a plan states about its axes under its budget; None for a plan without one.

    Args:
        plan: The plan.
        tree: Its team, needed for a budget that has the team's bodies.

    Raises:
        RefusalError: Names the transition, the entry and the axis.
    """
    budget, axes = plan.budget, plan.start.size - 2
    if budget is None or not budget.axes:
        parts = {f"transitions[{k}].tolerance": one.tolerance for k, one in enumerate(plan.transitions)}
        for where, part in (*parts.items(), ("axis_tracking", plan.axis_tracking)):
            if part is not None:
                raise RefusalError(where, "is stated, but the plan has no budget for the axes")
        return None if budget is None else Check("angles and joints are not part of the budget", 0)
    _alarms(plan)  # they are stated
    tracking, (couplings, efforts) = _tracking(plan, budget), _team(plan, budget, tree)
    if budget.rubs:  # viscous friction counts with the rates that axes never exceed, which is checked below
        pushes = friction_pushes(budget, couplings, np.array(tracking.rate or 0.0))
        _require(np.array(tracking.disturbance), pushes, False, "axis_tracking.disturbance")
    loop, limited = _loop(tracking, budget), None
    if efforts is not None:
        limited = LimitedEfforts(efforts, _tube(plan).acceleration)
    conditions = AxisConditions(budget.period, budget.lag)
    periods = whole_periods(budget.report_age, budget.period)
    entries = [Entry(x, x, rest=x) for x in plan.start[2:].tolist()]
    entered, commanded, smallest = at_rest(loop, axes), nothing_commanded(loop, axes), np.inf
    missed = np.zeros(axes)
    for k, transition in enumerate(plan.transitions):
        stated, where = transition.tolerance, f"transitions[{k}].tolerance"
        if stated is None:
            raise RefusalError(where, "is missing, but the plan has a budget")
        if transition.gains.funnel != "quintic":
            found = f"{transition.gains.funnel}: such a funnel never closes"
            raise RefusalError(f"transitions[{k}].gains.funnel", found)
        every, table = _sets(plan, k, stated, entries, conditions)
        leaving = first_leaving(table, every, budget.period)
        before, (away, entered) = entered, departing(loop, every, couplings.rates[k, 1:], entered, leaving)
        _check_departures(plan, k, table, every, away)
        seen = axis_room(budget, tracking, every, away, before)
        check_room(
            missed, room_at_entry(seen, budget), f"{where}.alarm_times", "a monitor in the cell before"
        )
        earlier = missed if leaving_since(budget, leaving) == 0 else 0.0 * missed  # still unknown when left
        missed = np.maximum(_check_axis_alarms(stated, seen, budget, leaving, where), earlier)
        _check_rate_alarms(stated, budget, tracking, where)
        if limited is not None:
            effort, rates, commanded = transition_efforts(k, limited, every, away, loop, commanded, leaving)
            _check_efforts(stated.effort, effort, rates, limited, f"{where}.effort")
        entries = [next_entry(row, sets, conditions, periods) for row, sets in zip(table, every, strict=True)]
        smallest = min(smallest, float(stated.distance.min()))
    name, count = "axes stay in their funnels under the budget", axes * len(plan.transitions)
    return Check(name, count, smallest, "rad or m to a funnel's bound")


def _tracking(plan: Plan, budget: Budget) -> AxisTracking:
    """Return how axes are pulled to their nominal motions, with as many numbers as there must be."""
    tracking = plan.axis_tracking
    if tracking is None:
        raise RefusalError("axis_tracking", "is missing, but the plan has a budget")
    if tracking.law != LAW:
        raise RefusalError("axis_tracking.law", f"is {tracking.law!r}; sets are checked for {LAW!r}")
    axes = plan.start.size - 2
    timed = axes if budget.clock_error or budget.joint_viscous else 0
    needed = {"rate": timed, "acceleration": timed, "disturbance": 1 + axes if budget.rubs else 0}
    for name, count in needed.items():
        if len(getattr(tracking, name)) != count:
            found = f"has {len(getattr(tracking, name))} numbers, not {count}"
            raise RefusalError(f"axis_tracking.{name}", found)
    return tracking


def _loop(tracking: AxisTracking, budget: Budget) -> AxisLoop:
    loop = axis_loop(tracking, budget)
    if loop is None:
        finding = f"the axes do not come to rest within {HORIZON} s for every error of the model"
        raise RefusalError("axis_tracking", finding)
    return loop


def _tube(plan: Plan) -> PositionTube:
    if plan.tube is None:
        raise RefusalError("tube", "is missing, but the plan has a budget")
    return plan.tube


def _alarms(plan: Plan) -> Alarms:
    """Return the levels that a plan with a budget states for all transitions."""
    if plan.alarms is None:
        raise RefusalError("alarms", "is missing, but the plan has a budget")
    return plan.alarms


def _team(plan: Plan, budget: Budget, tree: ComponentTree | None) -> TeamCouplings:
    """Return what the masses couple in every cell, nothing where the budget has no bodies."""
    if tree is None:
        if budget.bodies:
            raise ValueError("tree: expected the team, because the plan's budget has its bodies")
        return TeamCouplings(uncoupled(plan.cells), None)
    for name, rows in (("bodies", budget.bodies), ("bases", budget.bases)):
        if max((row[0] for row in rows), default=0) >= len(tree.components):
            raise RefusalError(f"budget.{name}", f"expected components below {len(tree.components)}")
    for name in ("rotors", "dampings"):
        if len(getattr(budget, name)) not in (0, len(tree.joints)):
            found = f"has {len(getattr(budget, name))} numbers, not {len(tree.joints)}"
            raise RefusalError(f"budget.{name}", found)
    return team_couplings(budget, tree, plan.cells)


_ENTRY = (
    "entry_lower", "entry_upper", "entry_rate_lower", "entry_rate_upper", "entry_acceleration",
)  # fmt: skip


def _sets(
    plan: Plan, k: int, stated: Tolerance, entries: list[Entry], conditions: AxisConditions
) -> tuple[list[AxisSets], FloatArray]:
    """Check the nominal motions of one transition; return the sets of all axes and their table.

    Args:
        plan: The plan.
        k: The transition.
        stated: What it states.
        entries: The sets in which the axes can enter it.
        conditions: How nominal motions are computed.
    """
    where, gains = f"transitions[{k}].tolerance", plan.transitions[k].gains
    for name, own in zip(_ENTRY, ("lower", "upper", "rate_lower", "rate_upper", "acceleration"), strict=True):
        found = np.array([getattr(entry, own) for entry in entries])
        _require(getattr(stated, name), found, own in ("lower", "rate_lower"), f"{where}.{name}")
    if gains.rest is None:
        raise RefusalError(f"transitions[{k}].gains.rest", "is missing, but the plan has a budget")
    table, every = axis_table(plan.funnel(k), gains), list[AxisSets]()
    for axis, (row, entry) in enumerate(zip(table, entries, strict=True)):
        low, high, slow, quick, pushed = (float(getattr(stated, name)[axis]) for name in _ENTRY)
        entered = Entry(low, high, slow, quick, pushed, entry.rest)
        settled = float(stated.settled[axis]), float(stated.settled_rate[axis])
        sets = axis_sets(row, conditions, entered, stated.entry_parts[axis], settled)
        if not sets.distance > 0.0:
            raise RefusalError(f"{where}[{axis}]", "an axis may leave its funnel")
        if comes_near_limit(row, sets):
            raise RefusalError(
                f"{where}[{axis}]", "an axis may ask for more than its limits of rate or acceleration"
            )
        every.append(sets)
    for name, values in (
        ("acceleration", [sets.acceleration for sets in every]),
        ("settled", [sets.needed[0] for sets in every]),
        ("settled_rate", [sets.needed[1] for sets in every]),
    ):
        _require(getattr(stated, name), np.array(values), False, f"{where}.{name}")
    widths = plan.transitions[k].goal_upper - plan.transitions[k].goal_lower
    if not (gains.rest.reach <= (0.5 - EROSION) * widths * (1.0 + ROUNDING)).all():
        finding = f"is {gains.rest.reach.tolist()}: an axis may count as at rest outside of its goal interval"
        raise RefusalError(f"transitions[{k}].gains.rest.reach", finding)
    if not ((stated.settled <= gains.rest.reach).all() and (stated.settled_rate <= gains.rest.rate).all()):
        raise RefusalError(where, "an axis may never count as arrived")
    return every, table


def _check_departures(plan: Plan, k: int, table: FloatArray, every: list[AxisSets], away: Departures) -> None:
    """Check how far axes and their rates may depart from their nominal motions, and what this leaves."""
    stated, tracking, budget = plan.transitions[k].tolerance, plan.axis_tracking, plan.budget
    assert stated is not None  # checked by the caller
    assert tracking is not None
    assert budget is not None
    where, most = f"transitions[{k}].tolerance", plan.transitions[k].gains.acceleration_limit
    _require(stated.departure, away.position.max(axis=0), False, f"{where}.departure")
    _require(stated.rate_departure, away.rate.max(axis=0), False, f"{where}.rate_departure")
    spare = np.array([sets.spare(away.position[:, i]) for i, sets in enumerate(every)])
    _require(stated.distance, spare, True, f"{where}.distance")
    if not (stated.distance > 0.0).all():
        raise RefusalError(where, "an axis may leave its funnel")
    pushed = stated.acceleration + away.acceleration.max(axis=0)
    fastest = np.array([sets.fastest(away.rate[:, i], budget.period) for i, sets in enumerate(every)])
    if most is not None and not (pushed <= most).all():
        raise RefusalError(where, "an axis may exceed its limit of acceleration")
    if not (fastest <= table[:, RATE_LIMIT]).all():
        raise RefusalError(where, "an axis may be faster than its limit")
    if tracking.rate:
        _require(np.array(tracking.rate), fastest, False, "axis_tracking.rate")
        _require(np.array(tracking.acceleration), pushed, False, "axis_tracking.acceleration")


def _require(stated: FloatArray, found: FloatArray, least: bool, where: str) -> None:
    """Refuse a stated bound that the found values exceed; ``least`` says that it is a lower one."""
    room = ROUNDING * np.abs(found) + LEAST
    good = stated <= found + room if least else stated >= found - room
    if not good.all():
        axis, side = int(np.argmin(good)), "down" if least else "up"
        finding = f"is {stated[axis]:.6g}; the budget gives {side} to {found[axis]:.6g}"
        raise RefusalError(f"{where}[{axis}]", finding)


def _check_axis_alarms(
    stated: Tolerance, seen: AxisRoom, budget: Budget, leaving: int, where: str
) -> FloatArray:
    """Check the levels of the axes in a transition, and that what they miss stays in the funnels.

    Args:
        stated: What the transition states.
        seen: What monitors see and may miss.
        budget: The budget.
        leaving: The first sample at which the cell can be left.
        where: What states it.

    Returns:
        How far off axes may be when the cell is left, while no report tells of it, shape (axes,) [rad or m].
    """
    times, axes = stated.alarm_times, stated.departure.size
    if times.size == 0 or times[0] != 0.0 or not (np.diff(times) > 0.0).all():
        raise RefusalError(f"{where}.alarm_times", f"is {times.tolist()}; times must grow from 0")
    for name in ("alarm", "ahead_alarm"):
        shapes = [one.size for one in getattr(stated, name)]
        if shapes != [axes] * times.size:
            finding = f"has rows of {shapes} numbers, not {times.size} of {axes}"
            raise RefusalError(f"{where}.{name}", finding)
    samples, missed = len(seen.room), np.zeros(axes)
    first = np.minimum(np.ceil(times / budget.period - ROUNDING), samples).astype(int).tolist()
    ends = [*first[1:], samples]
    for i, (begin, end) in enumerate(zip(first, ends, strict=True)):
        least, room = of_stage(seen, budget, begin, end)
        levels = np.array([stated.alarm[i], stated.ahead_alarm[i]])
        for name, level, due in zip(("alarm", "ahead_alarm"), levels, least, strict=True):
            _require(level, due, False, f"{where}.{name}[{i}]")
        off = may_miss(budget, levels)
        for name, one in zip(("alarm", "ahead_alarm"), off, strict=True):
            check_room(one, room, f"{where}.{name}[{i}]", "its monitor")
        if end > leaving_since(budget, leaving):
            missed = np.maximum(missed, off.max(axis=0))
    return missed


def _check_rate_alarms(stated: Tolerance, budget: Budget, tracking: AxisTracking, where: str) -> None:
    """Check the levels of the axes' rates in a transition."""
    least = stated.rate_departure + rate_noises(budget, tracking, stated.rate_departure.size)
    if stated.rate_alarm.shape != least.shape:
        raise RefusalError(f"{where}.rate_alarm", f"has {stated.rate_alarm.size} numbers, not {least.size}")
    for axis, (level, own) in enumerate(zip(stated.rate_alarm.tolist(), least.tolist(), strict=True)):
        _require_level(level, own, f"{where}.rate_alarm[{axis}]")


def check_room(off: FloatArray, room: FloatArray, where: str, monitor: str) -> None:
    """Check that axes stay in their funnels while nobody knows of what departs.

    Args:
        off: Largest departures that monitors may miss, shape (axes,) [rad or m].
        room: Departures with which the axes still stay in their funnels, shape (axes,) [rad or m].
        where: What states the levels.
        monitor: Whose levels these are, in words.
    """
    for axis, (needed, left) in enumerate(zip(off.tolist(), room.tolist(), strict=True)):
        if not left >= needed:
            finding = f"leaves {left:.6g} to a bound of the funnel; {monitor} may miss {needed:.6g}"
            raise RefusalError(f"{where}[{axis}]", finding)


def _require_level(stated: float, least: float, where: str) -> None:
    """Refuse a level that is not the one that follows: a lower one rings in vain, a higher one sees less."""
    if not abs(stated - least) <= ROUNDING * (1.0 + least):
        raise RefusalError(where, f"is {stated:.9g}; the budget gives {least:.9g}")


def _check_efforts(
    stated: FloatArray, found: FloatArray, rates: FloatArray, limited: LimitedEfforts, where: str
) -> None:
    """Check that no robot is told to give more than its actuators can, whatever departs within the budget."""
    limits = limited.efforts.limits
    if stated.shape != limits.shape:
        raise RefusalError(where, f"has {stated.size} numbers, not {limits.size}")
    if not rates.max() <= QUICKEST:
        raise RefusalError(where, f"is no bound for axes that turn at {rates.max():.3g}, above {QUICKEST:g}")
    _require(stated, found, False, where)
    if not (stated <= limits).all():
        worst = int(np.argmin(stated <= limits))
        raise RefusalError(f"{where}[{worst}]", f"is {stated[worst]:.6g}; the limit is {limits[worst]:.6g}")


def check_efforts(plan: Plan) -> list[Check]:
    """Return the smallest room of the limited efforts; nothing where the budget limits none."""
    budget = plan.budget
    if budget is None or not budget.limited:
        return []
    stated = np.array([one.tolerance.effort for one in plan.transitions if one.tolerance is not None])
    robots, checks = budget.robots, list[Check]()
    parts = stated[:, :robots], stated[:, robots : 2 * robots], stated[:, 2 * robots :]
    units = "N to spare", "N m to spare", "N m or N to spare"
    for name, part, unit in zip(LIMITS, parts, units, strict=True):
        limit = getattr(budget, name)
        if limit is not None and part.size:
            what = f"no {name.replace('_', ' ')} is asked for beyond its limit under the budget"
            checks.append(Check(what, part.size, limit - float(part.max()), unit))
    return checks


def check_position(plan: Plan, position_tolerance: float) -> list[Check]:
    """Check what a plan states about its position under its budget; nothing for a plan without one.

    Args:
        plan: The plan.
        position_tolerance: How close to the goal the object shall come to rest [m].

    Raises:
        RefusalError: Names the entry, and what the budget gives.
    """
    if plan.budget is None:
        regions = {f"transitions[{k}].governed": one.governed for k, one in enumerate(plan.transitions)}
        for where, stated in (("tube", plan.tube), ("alarms", plan.alarms), *regions.items()):
            if stated is not None:
                raise RefusalError(where, "is stated, but the plan has no budget")
        return []
    tube, budget = _tube(plan), rubbed(plan.budget, plan.axis_tracking)
    _check_tube(plan, tube, budget)
    _check_alarms(_alarms(plan), tube, budget)
    needed = position_room(budget, tube)
    least = min(_check_region(plan, k, needed) for k in range(len(plan.cells)))
    for k in range(len(plan.cells)):
        _check_path(plan, k)
    away = float(np.hypot(*(plan.transitions[-1].target - plan.goal_pose[:2])))
    room = position_tolerance - away
    if not tube.rest < room:
        finding = f"is {tube.rest:.6g} m; the goal's tolerance leaves {room:.6g} m about the last target"
        raise RefusalError("tube.rest", finding)
    return [
        Check("the object stays in its cells under the budget", len(plan.cells), least, "m to spare, least"),
        Check("the object comes to rest at the goal", 1, room - tube.rest, "m to spare"),
    ]


def _check_tube(plan: Plan, tube: PositionTube, budget: Budget) -> None:
    """Check the tube against the responses of the loop, which must be the same in all transitions."""
    gains = [transition.gains for transition in plan.transitions]
    for k, own in enumerate(gains):
        for name in ("stiffness", "damping"):
            if getattr(own, name) != getattr(gains[0], name):
                finding = f"is {getattr(own, name):.6g}; a plan with a tube has one for all transitions"
                raise RefusalError(f"transitions[{k}].gains.{name}", finding)
    limit = gains[0].speed_limit  # check_speeds has seen that all transitions have the same
    if limit is not None and not tube.velocity <= limit:
        finding = f"is {tube.velocity:.6g} m/s; the gains' limit of speed is {limit:.6g} m/s"
        raise RefusalError("tube.velocity", finding)
    tracking = tube.tracking_stiffness, tube.tracking_damping
    loop = PositionGains(gains[0].stiffness, gains[0].damping, *tracking, tube.speed)
    (found,) = position_bounds((loop,), budget)
    if found is None:
        raise RefusalError("tube", "its loop does not come to rest for every error of the model")
    names = ("radius", "rate", "velocity", "rest", "acceleration", "ahead")
    for name, value in zip(names, found.tolist(), strict=True):
        stated = getattr(tube, name)
        if not stated >= value * (1.0 - ROUNDING) - ROUNDING:
            raise RefusalError(f"tube.{name}", f"is {stated:.6g}; the budget gives up to {value:.6g}")


def _check_alarms(stated: Alarms, tube: PositionTube, budget: Budget) -> None:
    """Check the levels of position, velocity and grasp: they follow from the tube and the noise."""
    due = alarms_of(budget, tube)
    for name in ("position", "velocity", "ahead", "grasp", "turn"):
        level, least = getattr(stated, name), getattr(due, name)
        if (level is None) != (least is None):
            raise RefusalError(f"alarms.{name}", f"is {level}; the budget has {least}")
        if level is not None:
            _require_level(level, least, f"alarms.{name}")


def _check_region(plan: Plan, k: int, room: float) -> float:
    """Check the governed set of a transition; return by how much more than needed it is inside its cell [m].

    Args:
        plan: The plan.
        k: The transition.
        room: How far the object may be off its nominal position while no report tells of it [m].
    """
    cell, region, where = plan.cells[k].tidied, plan.transitions[k].governed, f"transitions[{k}].governed"
    if region is None:
        raise RefusalError(where, "is missing, but the plan has a budget")
    if not cell.contains(region):
        raise RefusalError(where, "leaves its cell")
    away = float(shapely.distance(region.boundary, cell.boundary))
    if not away >= room:
        finding = (
            f"comes within {away:.6g} m of the cell's boundary; the tube and its monitor need {room:.6g} m"
        )
        raise RefusalError(where, finding)
    return away - room


def _check_path(plan: Plan, k: int) -> None:
    """Check that p_G can go from where a governed set is entered to a target in this and the next one."""
    transition, where, region = plan.transitions[k], f"transitions[{k}]", plan.governed(k)
    path = LineString(transition.path)
    kept = float(shapely.distance(path, region.boundary)) - transition.neck
    entered = plan.start[:2] if k == 0 else plan.transitions[k - 1].target
    if not region.contains(path) or path.coords[0] != tuple(entered) or not kept >= -ROUNDING:
        raise RefusalError(f"{where}.path", "does not keep its clearance in the governed set")
    target = Point(transition.target)
    for i in range(k, min(k + 2, len(plan.cells))):
        held = plan.governed(i)
        if not held.contains(target):
            raise RefusalError(f"{where}.target", "is outside a governed set that it joins")
        if not float(held.boundary.distance(target)) >= transition.inradius - ROUNDING:
            raise RefusalError(f"{where}.inradius", "is more than the governed sets leave")


def check_restart(plan: Plan, tree: ComponentTree) -> Check | None:
    """Check from which rests a plan says that its cells can be begun anew; None where it states nothing.

    On the slow way after a rest no axis has a larger nominal rate or acceleration than stated, and none
    leaves its slice, if it begins inside by the stated departure. Once the way is over and the stated time
    has passed, nothing of it is left in the loops of the axes: what holds for the cell that was entered from
    the one before holds again.

    Args:
        plan: The plan, whose budget has been checked.
        tree: Its team.

    Raises:
        RefusalError: Names the entry.
    """
    stated, axes, budget, tracking = plan.restart, plan.start.size - 2, plan.budget, plan.axis_tracking
    if stated is None:
        return None
    if budget is None or not budget.axes or tracking is None:
        raise RefusalError("restart", "is stated, but the plan has no budget for the axes")
    tube, governor = _tube(plan), (plan.transitions[0].gains.stiffness, plan.transitions[0].gains.damping)
    if not position_may_rest(tube, governor, rubbed(budget, tracking), stated.rest_rate):
        raise RefusalError("restart.rest_rate", "the object's tube does not hold from rests with such a rate")
    for name, least, why in (
        ("rest_rate", RATE_TOLERANCE, "which is taken for resting"),
        ("wait", HORIZON, "the length of a response"),
    ):
        if getattr(stated, name) < least:
            finding = f"is {getattr(stated, name):g}, below {least:g}, {why}"
            raise RefusalError(f"restart.{name}", finding)
    if len(stated.departures) != len(plan.cells):
        finding = f"has {len(stated.departures)} rows for {len(plan.cells)} cells"
        raise RefusalError("restart.departures", finding)
    (couplings, efforts), loop = _team(plan, budget, tree), _loop(tracking, budget)
    started, moving = resting_axes(loop, stated.rest_rate), (stated.acceleration, stated.rate)
    least, pulls = np.inf, []
    for k, (cell, own) in enumerate(zip(plan.cells, stated.departures, strict=True)):
        found = moving_evenly(loop, couplings.rates[k, 1:], moving)
        away = found.position + started[0]
        if own.shape != (axes,) or not (own >= away - ROUNDING).all():
            raise RefusalError(f"restart.departures[{k}]", f"the budget gives up to {away.max():.6g}")
        reached = stated.rate + found.rate + started[1], stated.acceleration + found.acceleration + started[2]
        gains = plan.transitions[k].gains
        for name, most, value, counted in (
            ("rate", gains.rate_limit, reached[0], tracking.rate),
            ("acceleration", gains.acceleration_limit, reached[1], tracking.acceleration),
        ):
            if most is not None and not (value <= most).all():
                raise RefusalError(f"restart.{name}", f"in cell {k} an axis may exceed its limit")
            if counted and not (value <= counted).all():
                raise RefusalError(f"restart.{name}", f"in cell {k} wrong ages count with less")
        pulls.append(found.pull + started[3] + single_noise(loop, axes))
        least = min(least, float((0.5 * (cell.upper - cell.lower) - own).min()))
    if efforts is not None:
        limited = LimitedEfforts(efforts, tube.acceleration)
        asked = even_efforts(limited, budget, (stated.rate, stated.acceleration), np.array(pulls))
        if not (asked <= efforts.limits).all():
            raise RefusalError(
                "restart.acceleration", "a robot may be told to give more than its limits allow"
            )
    name = "cells can be begun anew from rests inside them under the budget"
    return Check(name, len(plan.cells), least, "rad or m to the ends of slices from their middle")
