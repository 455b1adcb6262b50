"""Check the gains that a plan states, and which limits of the scenario it keeps, by computing them again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot

import numpy as np
from shapely import LineString, Point

from coop_drake.answers.plan import SLOWEST_AGE, Plan, Refusal, SpeedStatement, Unit, other_age
from coop_drake.answers.problem import PlanningProblem, TeamLimits
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet, ScheduledGains, TransitionGains, transition_gains
from coop_drake.planning.duration import estimated
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree, usual_unit
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.bodies import component_stages, levers
from coop_drake.verification.runs.laws import SHAPES

RELATIVE = 1e-9
"""Relative difference of figures that are computed twice, in another order of operations [-]."""

SAME_PLACE = 1e-9
"""Paths shorter than this do not move the position, only angles [m]."""


def check_gains(plan: Plan, gain_sets: Mapping[str, GainSet]) -> Check:
    """Compute the gains of every transition again; all that is geometry belongs to the exact checker.

    Limits are taken as they are stated; ``check_speeds`` and ``check_accelerations`` check them.

    Args:
        plan: The plan.
        gain_sets: The scenario's gain sets by name.

    Raises:
        RefusalError: Names the transition, the figure and what it should be.
    """
    if plan.gain_set not in gain_sets:
        raise RefusalError("gain_set", f"{plan.gain_set!r} is none of {', '.join(sorted(gain_sets))}")
    if other := other_age(plan, gain_sets[plan.gain_set]):
        raise RefusalError("transitions[0].gains.rate_gain", other)
    check_ages(plan, gain_sets[plan.gain_set])
    resting = plan.start[2:]
    for k, transition in enumerate(plan.transitions):
        where = f"transitions[{k}]"
        if transition.only_angles != (transition.length <= SAME_PLACE):
            raise RefusalError(f"{where}.only_angles", f"{transition.only_angles} over {transition.length} m")
        gain_set = gain_sets[plan.gain_set]
        if isinstance(gain_set, ScheduledGains):
            gain_set = gain_set.slowed(plan.age_factor)
        gains = transition_gains(
            gain_set,
            clearance=transition.neck,
            slice_lower=plan.cells[k].lower,
            slice_upper=plan.cells[k].upper,
            goal_lower=transition.goal_lower,
            goal_upper=transition.goal_upper,
            resting=resting,
            speed_limit=transition.gains.speed_limit,
            rate_limit=transition.gains.rate_limit,
            acceleration_limit=transition.gains.acceleration_limit,
        )
        _compare(transition.gains, gains, f"{where}.gains")
        resting = 0.5 * (transition.goal_lower + transition.goal_upper)
    name = "gains are those that the gain set gives for the cells"
    if plan.motion is not None:
        name = "gains of a team that would rest in every cell are those of the gain set"
    return Check(name, len(plan.transitions))


def check_ages(plan: Plan, gain_set: GainSet) -> None:
    """Refuse gains for commands that are younger than the team's.

    Raises:
        RefusalError: Names the factor.
    """
    if not isinstance(gain_set, ScheduledGains):
        if plan.age_factor != 1.0:
            finding = f"is {plan.age_factor}; fixed gains are for no age, so that it is 1"
            raise RefusalError("age_factor", finding)
        return
    if not plan.age_factor >= 1.0:
        finding = f"is {plan.age_factor}: the gains are for commands that are younger than the team's"
        raise RefusalError("age_factor", finding)


def _compare(found: TransitionGains, expected: TransitionGains, where: str) -> None:
    for name, value in vars(expected).items():
        stated = getattr(found, name)
        same = value is None or stated is None or isinstance(value, str)
        if not (stated == value if same else np.allclose(stated, value, rtol=RELATIVE, atol=0.0)):
            raise RefusalError(f"{where}.{name}", f"is {stated}; the cell gives {value}")


# Check what a plan states about speeds: the limits, and that its gains keep them, by bounds computed again.
#
# A point of a component moves at most as fast as the object, plus for every joint on the way (and theta)
# the rate of that joint times its lever: for one that turns, the greatest distance of the point from the
# joint.


def check_speeds(plan: Plan, problem: PlanningProblem) -> Check | None:
    """Check the limits of speed in a plan and its gains; None where neither models nor scenario state any.

    The gains of a plan with a motion are without limits: it is the motion that keeps them.

    Raises:
        RefusalError: Names the entry, and what it should be.
    """
    limits, stated = problem.limits, plan.speeds
    if plan.motion is not None:
        _refuse_limited_gains(plan)
        return None
    if not limits.any:
        gains = [transition.gains for transition in plan.transitions]
        if stated is not None or any(g.speed_limit is not None or g.rate_limit is not None for g in gains):
            raise RefusalError("speeds", "are limited, but neither models nor scenario state a limit")
        return None
    if stated is None:
        raise RefusalError("speeds", "are missing; models or scenario state limits of speed")
    _check_limits(stated, limits)
    speed, rates = _limits_in_gains(plan)
    least = _require_below("transitions[0].gains.rate_limit", rates[1:], limits.joint_rates)
    for name, found, most, turning in (
        ("base_speeds", stated.base_speeds, stated.base_speed_limits, False),
        ("turn_rates", stated.turn_rates, stated.turn_rate_limits, True),
    ):
        bounds = _bounds(problem.tree, limits, speed, rates, turning=turning)
        if found.shape != bounds.shape or not np.allclose(
            found, bounds, rtol=RELATIVE, atol=0.0
        ):  # infinities are equal
            raise RefusalError(f"speeds.{name}", f"are {found.tolist()}; the gains give {bounds.tolist()}")
        least = min(least, _require_below(f"speeds.{name}", bounds, most))
    _check_funnels(plan, rates)
    count = sum(
        int(np.isfinite(values).sum())
        for values in (limits.base_speeds, limits.turn_rates, limits.joint_rates)
    )
    return Check("limits of speed are kept by the gains", count, least, "of one left")


def _refuse_limited_gains(plan: Plan) -> None:
    """Refuse what only a team that rests in every cell does to keep limits, beside a motion."""
    stated = {"speeds": plan.speeds, "age_factor": None if plan.age_factor == 1.0 else plan.age_factor}
    for k, transition in enumerate(plan.transitions):
        for name in ("speed_limit", "rate_limit", "acceleration_limit"):
            stated[f"transitions[{k}].gains.{name}"] = getattr(transition.gains, name)
    for where, found in stated.items():
        if found is not None:
            raise RefusalError(
                where, "limits a team that rests in every cell; in this plan the motion keeps limits"
            )


def check_accelerations(plan: Plan, problem: PlanningProblem) -> Check | None:
    """Check that no more is commanded of any joint than its limit of acceleration; None without limits.

    Raises:
        RefusalError: Names the entry, and what it should be.
    """
    if plan.motion is not None:
        return None  # Its gains have no limits, see ``check_speeds``.
    limits = problem.limits.joint_accelerations
    known, least = np.isfinite(limits), 1.0
    commanded = np.array([np.inf, *(PLANNED_SHARE * limits)])
    for k, transition in enumerate(plan.transitions):
        where, stated = f"transitions[{k}].gains.acceleration_limit", transition.gains.acceleration_limit
        if stated is None and known.any():
            raise RefusalError(where, "is missing; models or scenario state limits of acceleration")
        if stated is not None and not known.any():
            raise RefusalError(where, "is there, but neither models nor scenario state a limit")
        if stated is not None:
            if not np.allclose(stated, commanded, rtol=RELATIVE, atol=0.0):
                text = f"is {stated.tolist()}; {PLANNED_SHARE:g} of the limits is {commanded.tolist()}"
                raise RefusalError(where, text)
            least = min(least, _require_below(where, stated[1:], limits))
    name = "limits of acceleration are kept by the commands"
    return Check(name, int(known.sum()), least, "of one left") if known.any() else None


def _check_limits(stated: SpeedStatement, limits: TeamLimits) -> None:
    for name, found, expected in (
        ("base_speed_limits", stated.base_speed_limits, limits.base_speeds),
        ("turn_rate_limits", stated.turn_rate_limits, limits.turn_rates),
        ("joint_rate_limits", stated.joint_rate_limits, limits.joint_rates),
    ):
        if not np.array_equal(found, expected):
            text = f"are {found.tolist()}; models and scenario state {expected.tolist()}"
            raise RefusalError(f"speeds.{name}", text)


def _limits_in_gains(plan: Plan) -> tuple[float, FloatArray]:
    """The largest speed of the object and the rates of all axes, which are the same in all transitions."""
    first = plan.transitions[0].gains
    if first.rate_limit is None:
        raise RefusalError("transitions[0].gains.rate_limit", "is missing")
    for k, transition in enumerate(plan.transitions):
        gains, where = transition.gains, f"transitions[{k}].gains"
        if gains.speed_limit != first.speed_limit:
            raise RefusalError(f"{where}.speed_limit", f"is {gains.speed_limit}, not {first.speed_limit}")
        if gains.rate_limit is None or not np.array_equal(gains.rate_limit, first.rate_limit):
            raise RefusalError(f"{where}.rate_limit", "is not that of the first transition")
    return np.inf if first.speed_limit is None else first.speed_limit, first.rate_limit


def _require_below(where: str, values: FloatArray, limits: FloatArray) -> float:
    """Refuse values above their limits; return what the tightest leaves, as a share of its limit."""
    known = np.isfinite(limits)
    if not (values[known] <= limits[known]).all():
        raise RefusalError(where, f"{values.tolist()} exceed the limits {limits.tolist()}")
    return float((1.0 - values[known] / limits[known]).min(initial=1.0))


def _bounds(
    tree: ComponentTree, limits: TeamLimits, speed: float, rates: FloatArray, *, turning: bool
) -> FloatArray:
    """Largest speeds of all bases [m/s], or their largest turn rates [rad/s], shape (N,)."""
    slides = np.concatenate((np.zeros(3), np.maximum(np.abs(tree.joint_lower), np.abs(tree.joint_upper))))
    bounds = np.full(len(limits.base_points), 0.0 if turning else speed)
    for k, (component, point) in enumerate(zip(limits.base_components, limits.base_points, strict=True)):
        stages = component_stages(tree, component)
        each = (
            [stage.kind == "revolute" for stage in stages]
            if turning
            else levers(hypot(*point), stages, slides)
        )
        for stage, lever in zip(stages, each, strict=True):
            bounds[k] += lever * rates[1 + stage.index] if lever > 0.0 else 0.0
    return bounds


def _check_funnels(plan: Plan, rates: FloatArray) -> None:
    """Refuse funnels whose bounds move faster than the axis that they hold may."""
    for k, (cell, transition) in enumerate(zip(plan.cells, plan.transitions, strict=True)):
        gains = transition.gains
        moved = np.maximum(transition.goal_lower - cell.lower, cell.upper - transition.goal_upper)
        fastest = SHAPES[gains.funnel][1] * gains.decay_rate * moved
        if not (fastest <= rates).all():
            axis = int(np.argmax(fastest > rates))
            text = f"moves a bound of axis {axis} at {fastest[axis]:.6g}, faster than {rates[axis]:.6g}"
            raise RefusalError(f"transitions[{k}].gains.decay_rate", text)


# Check which limits of the scenario a plan breaks: what it has is computed again, and it must say so.

SAME_VALUE = 1e-6
"""Relative difference of values that are computed twice, maybe on machines that round otherwise [-]."""

CLEARANCE_ROUNDING = 1e-9
"""Clearances that miss a limit by less than this share of it keep it [-]."""

PLANNED_SHARE = 0.95
"""Share of a joint's limit of acceleration that a plan may command [-]; the rest is for noise."""

GOAL_SHARE = 0.9
"""The room about the end need not be wider than this share of what the goal's tolerance leaves there [-]."""


def check_limits(plan: Plan, problem: PlanningProblem, gain_set: GainSet) -> list[Check]:
    """Compute clearances, estimated times and accelerations again, and what limits they break.

    A plan that can be carried out breaks none; a way says which ones it breaks, where and by how much.

    Args:
        plan: The plan or way, whose geometry and gains hold.
        problem: What is asked, with the limits.
        gain_set: The gain set that its gains are those of.

    Raises:
        RefusalError: Names the entry, and what is computed.
    """
    if plan.motion is None:
        again, _, accelerations = estimated(plan)
        times, source = np.array([one.estimated_time for one in again.transitions]), "the simulation"
    else:
        entries, end = plan.motion.windows[:, 0], len(plan.motion.points) - 3
        times, source = np.append(entries[1:], end * plan.motion.period) - entries, "the motion"
        accelerations = np.zeros((len(times), len(plan.start) - 2))  # ``check_motion`` checks those it has.
    for k, (stated, seconds) in enumerate(zip(plan.transitions, times.tolist(), strict=True)):
        if not abs(stated.estimated_time - seconds) <= SAME_VALUE * seconds:
            finding = f"is {stated.estimated_time} s; by {source}, the transition takes {seconds} s"
            raise RefusalError(f"transitions[{k}].estimated_time", finding)
    found = _broken(plan, problem, times, accelerations)
    broken = {(worst.limit, worst.joint): (worst, values) for worst, values in found}
    for k, refusal in enumerate(plan.refused_by):
        _check_stated(refusal, broken.get((refusal.limit, refusal.joint)), f"refused_by[{k}]")
    said = {refusal.limit for refusal in plan.refused_by}
    if len(said) < len(plan.refused_by):
        raise RefusalError("refused_by", "names a limit twice")
    for worst, _ in broken.values():
        if worst.limit not in said:
            raise RefusalError("refused_by", f"does not say that the plan breaks {worst.describe()}")
    _check_age(plan, gain_set)
    checks = [Check(f"times of all transitions are those of {source}", len(times))]
    if plan.refused_by:
        return [*checks, Check("limits of the scenario that the plan breaks", len(plan.refused_by))]
    kept = "clearances, times and accelerations" if plan.motion is None else "clearances and times"
    return [*checks, Check(f"{kept} keep the scenario's limits", len(times))]


def _check_stated(stated: Refusal, own: tuple[Refusal, FloatArray] | None, where: str) -> None:
    """Refuse a statement about a limit that is kept or not the scenario's, or about another value."""
    if own is None:
        raise RefusalError(where, f"{stated.describe()}: the scenario has no such limit, or it is kept")
    worst, values = own
    known = stated.cell < len(values) and (stated.allowed, stated.unit) == (worst.allowed, worst.unit)
    room = SAME_VALUE * worst.value
    if not (known and max(abs(stated.value - worst.value), abs(values[stated.cell] - worst.value)) <= room):
        raise RefusalError(where, f"{stated.describe()}: computed again, {worst.describe()}")


def _broken(
    plan: Plan, problem: PlanningProblem, times: FloatArray, accelerations: FloatArray
) -> Iterator[tuple[Refusal, FloatArray]]:
    """The limits that a plan breaks, in the cell that breaks each most, and what all cells have, (cells,)."""
    settings = problem.settings
    least, longest = usual_unit(problem.tree) * settings.min_clearance, settings.max_transition_time
    clear = _clearances(plan, problem, least)
    if clear.min() < least * (1.0 - CLEARANCE_ROUNDING):
        cell = int(clear.argmin())
        yield Refusal("planner.min_clearance", cell, float(clear[cell]), least, "m"), clear
    if times.max() > longest:
        cell = int(times.argmax())
        yield Refusal("planner.max_transition_time", cell, float(times[cell]), longest, "s"), times
    for joint, limit in zip(problem.tree.joints, problem.limits.joint_accelerations.tolist(), strict=False):
        peaks = accelerations[:, 1 + joint.index]
        stated = [one.gains.acceleration_limit for one in plan.transitions]
        acting = [
            most is not None and peak >= most[1 + joint.index]
            for peak, most in zip(peaks.tolist(), stated, strict=True)
        ]
        values = peaks / PLANNED_SHARE
        unit: Unit = "rad/s^2" if joint.kind == "revolute" else "m/s^2"
        if np.isfinite(limit) and (values.max() >= limit or any(acting)):
            cell = int(values.argmax())
            name = "limits.joint_accelerations"
            yield Refusal(name, cell, float(values[cell]), limit, unit, joint.name), values


def _clearances(plan: Plan, problem: PlanningProblem, least: float) -> FloatArray:
    """The least clearance of path and target in each cell [m]; that of the end only where it is too small."""
    clear = []
    for k, transition in enumerate(plan.transitions):
        walls, target = plan.cells[k].tidied.boundary, Point(transition.target)
        path, about = LineString(transition.path).distance(walls), target.distance(walls)
        if k + 1 < len(plan.cells):
            about = min(about, target.distance(plan.cells[k + 1].tidied.boundary))
        else:
            left = problem.position_tolerance - hypot(*(transition.target - problem.goal_pose[:2]))
            about = min(about, left)
            about = np.inf if about >= min(least, GOAL_SHARE * left) * (1.0 - CLEARANCE_ROUNDING) else about
        clear.append(min(path, about))
    return np.array(clear)


def _check_age(plan: Plan, gain_set: GainSet) -> None:
    """Refuse a way with gains that are slower than it needs, or quicker than they might be."""
    if plan.refused_by and isinstance(gain_set, ScheduledGains):
        quick = any(one.limit == "limits.joint_accelerations" for one in plan.refused_by)
        expected = SLOWEST_AGE if quick else 1.0
        if plan.age_factor != expected:
            finding = f"is {plan.age_factor}; a way that these limits refuse has {expected}"
            raise RefusalError("age_factor", finding)
