"""Limits of speeds and accelerations: how a plan keeps them, and which of them refuse a plan."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import ceil, floor, inf, log10

import numpy as np
from numpy.typing import NDArray

from coop_drake.answers.plan import Plan, Refusal, SpeedStatement, Unit
from coop_drake.answers.problem import PlanningProblem, TeamLimits
from coop_drake.errors import TooQuickError
from coop_drake.laws.ppc import FUNNEL_SHARE, funnel_rate
from coop_drake.laws.readiness import RATE_TOLERANCE
from coop_drake.planning.duration import estimated
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree, point_levers, turn_levers, usual_unit

# How limits of bases are shared among the object's speed and the rates of its angle and of the joints.
#
# The speed of a base is at most the object's speed, plus the rate of each axis that moves the base times
# its lever, whatever the configuration; its turn rate is at most the sum of the rates of the object's angle
# and of the joints between. Limits of these speeds and rates, the same in the whole plan, therefore keep
# the limits of the bases. The limit of a base is shared in proportion to what each part would need without
# limits.

KEPT = 0.95
"""Share of every limit that is planned with [-]; the rest is for sampling, noise and integration."""

NEED_FACTOR = 1.15
"""What an axis needs over its largest estimated rate [-]: the closed loop differs from the estimate by a few
per cent, and no limit shall act there that need not."""

LARGEST_NEED = 100.0
"""No speed or rate needs more than this [m/s, rad/s]: limits are shared in proportion to needs."""

ROUNDING = 1e-9
"""Relative difference of sums in another order [-]."""

OBJECT_FACTORS = (1.0, 0.5, 0.7, 1.5, 2.0)
"""Shares of the object are tried that are so many times its need [-]: where it is the object that takes long,
a larger share is quicker, and a smaller one where the angles do."""


def speed_shares(problem: PlanningProblem, plan: Plan) -> Iterator[FloatArray]:
    """Yield limits of the object's speed and of all axes that keep the limits of bases and joints.

    Args:
        problem: What was asked, with the limits.
        plan: A plan for it without limits of speed.

    Yields:
        Limits, infinity where there is none, shape (2 + n,) [m/s, rad/s or m/s]. If the
        first ones do not slow the plan down, no others follow.
    """
    limits, needs = problem.limits, _needs(plan)
    levers = base_levers(problem.tree, limits)
    bounds = KEPT * np.concatenate((limits.base_speeds, limits.turn_rates))
    caps = np.concatenate((np.full(2, np.inf), KEPT * limits.joint_rates))
    for factor in OBJECT_FACTORS:
        shares = fill(levers, bounds, caps, needs * np.array([factor, *np.ones(len(needs) - 1)]))
        yield shares
        if (shares >= needs).all():
            return


def base_levers(tree: ComponentTree, limits: TeamLimits) -> FloatArray:
    """Return what the object's speed and the rates of all axes add to the speeds of bases at most.

    Returns:
        Rows for the N speeds, then for the N turn rates of the bases, shape (2 N, 2 + n).
    """
    bases = list(zip(limits.base_components, limits.base_points, strict=True))
    speeds = [np.array([1.0, *point_levers(tree, component, point)]) for component, point in bases]
    turns = [np.array([0.0, *turn_levers(tree, component)]) for component, _ in bases]
    return np.array([*speeds, *turns])


def fill(levers: FloatArray, bounds: FloatArray, caps: FloatArray, needs: FloatArray) -> FloatArray:
    """Return the largest x that grow in proportion to needs while levers x <= bounds and x <= caps.

    Entries of a bound that is reached grow no more; the others go on.

    Args:
        levers: Not negative, shape (k, m).
        bounds: Infinity for none, shape (k,).
        caps: Infinity for none, shape (m,).
        needs: Positive, shape (m,).

    Returns:
        Shape (m,); infinity for entries without any bound.
    """
    levers, bounds = levers[np.isfinite(bounds)], bounds[np.isfinite(bounds)]
    growing: NDArray[np.bool_] = (levers > 0.0).any(axis=0) | np.isfinite(caps)
    shares, bounded = np.where(growing, 0.0, np.inf), growing.copy()
    while growing.any():
        growth = levers @ np.where(growing, needs, 0.0)
        left = bounds - levers @ np.where(bounded, shares, 0.0)
        steps = np.full(len(bounds), np.inf)
        np.divide(left, growth, where=growth > 0.0, out=steps)
        room = (caps[growing] - shares[growing]) / needs[growing]
        step = max(min(*steps, *room, np.inf, np.inf), 0.0)
        shares[growing] += step * needs[growing]
        reached = (levers[steps <= step * (1.0 + ROUNDING)] > 0.0).any(axis=0)
        growing &= ~reached & (shares < caps * (1.0 - ROUNDING))
    return np.minimum(shares, caps)


def limits_of(plan: Plan) -> FloatArray | None:
    """Return the limits in a plan's gains, as ``speed_shares`` yields them; None for a plan without."""
    gains = plan.transitions[0].gains
    if gains.rate_limit is None:
        return None
    return np.array([np.inf if gains.speed_limit is None else gains.speed_limit, *gains.rate_limit])


def stated_speeds(problem: PlanningProblem, shares: FloatArray) -> SpeedStatement:
    """Return what a plan states about the speeds of bases that keeps these limits, shape (2 + n,)."""
    limits, levers = problem.limits, base_levers(problem.tree, problem.limits)
    parts = np.multiply(levers, shares, where=levers > 0.0, out=np.zeros_like(levers))
    speeds, turns = np.split(parts.sum(axis=1), 2)
    return SpeedStatement(limits.base_speeds, limits.turn_rates, limits.joint_rates, speeds, turns)


def _needs(plan: Plan) -> FloatArray:
    """What the object and the axes need without limits, shape (2 + n,) [m/s, rad/s or m/s]."""
    fastest = NEED_FACTOR * estimated(plan)[1]
    for index, transition in enumerate(plan.transitions):
        funnel, quintic = plan.funnel(index), transition.gains.funnel == "quintic"
        shrink = np.maximum(funnel.goal_lower - funnel.slice_lower, funnel.slice_upper - funnel.goal_upper)
        rates = funnel_rate(funnel.decay_rate, shrink, quintic)
        fastest[1:] = np.maximum(fastest[1:], rates / FUNNEL_SHARE)
    return np.clip(fastest, RATE_TOLERANCE, LARGEST_NEED)  # An estimate may grow beyond all numbers.


# The accelerations that a plan may command of its joints, and whether the estimated transport needs more.


def planned_accelerations(limits: TeamLimits) -> FloatArray | None:
    """Return the largest accelerations of (theta, q...) that may be commanded, None without any limit.

    Returns:
        ``KEPT`` of the joints' limits, infinity for the angle, shape (1 + n,) [rad/s^2 or m/s^2].
    """
    known = np.isfinite(limits.joint_accelerations).any()
    return np.array([np.inf, *(KEPT * limits.joint_accelerations)]) if known else None


def check_accelerations(plan: Plan, most: FloatArray) -> None:
    """Refuse a plan in whose estimated transport the limit of a joint's acceleration acts.

    That an axis stays in its funnel is shown for the law without this limit.

    Args:
        plan: The plan.
        most: Largest accelerations of (theta, q...), shape (1 + n,) [rad/s^2 or m/s^2].

    Raises:
        TooQuickError: Names the first cell in which one acts, the joint and the limit.
    """
    acting = estimated(plan)[2] >= most
    if acting.any():
        cell, axis = np.argwhere(acting)[0]
        raise TooQuickError(
            f"cell {cell}: {plan.joint_names[axis - 1]} would be accelerated by more than {most[axis]:.3g}, "
            "what its limit of acceleration leaves; expected a larger limit, or gains for older commands"
        )


# The limit within which a motion through all cells takes too long.

_OF_MOTIONS = (
    ("base_speeds", "limits.*.base_speed", "m/s", 1),
    ("turn_rates", "limits.*.base_turn_rate", "rad/s", 1),
    ("joint_rates", "limits.*.joint_rates", "rad/s or m/s", 1),
    ("base_accelerations", "limits.*.base_acceleration", "m/s^2", 2),
    ("turn_accelerations", "limits.*.base_turn_acceleration", "rad/s^2", 2),
    ("joint_accelerations", "limits.*.joint_accelerations", "rad/s^2 or m/s^2", 2),
    ("object_acceleration", "limits.object.acceleration", "m/s^2", 2),
    ("frictions", "limits.*.friction", "of the weight", 2),
    ("base_forces", "deployment.actuators.base_force", "N", 2),
    ("base_jerks", "limits.*.base_jerk", "m/s^3", 3),
)
"""Limits that motions keep: attribute, key, unit, and by which power of 1/t each changes with the time t."""

SMALLEST_STEP, UNKNOWN_STEP = 1.02, 10.0
"""Smallest factor by which a limit that is too low is raised, and that where no motion is known [-]."""


def limit_too_low(
    limits: TeamLimits, seconds: float, longest: float, slowest: Callable[[TeamLimits], float]
) -> str | None:
    """Return which limit alone makes a motion too slow, and with which value it is quick enough, in words.

    Args:
        limits: What the team keeps, see ``PlanningProblem.kept_limits``.
        seconds: The longest time of a cell within them [s].
        longest: The longest one that is allowed [s].
        slowest: Returns the longest time of a cell within other limits, infinite where there is no motion.
    """
    usual = limits.usual(len(limits.joint_rates))
    for name, key, unit, power in _OF_MOTIONS:
        stated, most = getattr(limits, name), getattr(usual, name)
        if not (stated < most).any():
            continue
        if slowest(replace(limits, **{name: np.maximum(stated, most)})) > longest:
            continue
        value, now = float(stated.min()), seconds
        while now > longest and value < most.max():
            step = (now / longest) ** power if now < inf else UNKNOWN_STEP
            value = rounded_up(value * max(step, SMALLEST_STEP))
            now = slowest(replace(limits, **{name: np.maximum(stated, value)}))
        return (
            f"{key} is {stated.min():g} {unit}, with which a cell takes longer than the {longest:g} s that "
            f"planner.max_transition_time allows; expected {min(value, float(most.max())):g} {unit} or more"
        )
    return None


def rounded_up(value: float) -> float:
    """Return a positive number with two digits that is not below another one."""
    digit = 10.0 ** (floor(log10(value)) - 1)
    return float(f"{ceil(value / digit - ROUNDING) * digit:.2g}")


# The limits of a scenario with which a plan along a way that exists cannot be carried out.

GOAL_REGION_FRACTION = 0.9
"""The region of the goal need not be wider than this fraction of the position tolerance [-]."""


def without_limits(problem: PlanningProblem) -> PlanningProblem:
    """The question for which no passage is too narrow, no transition too long and no joint too quick."""
    settings = replace(problem.settings, min_clearance=0.0, max_transition_time=inf)
    limits = replace(problem.limits, joint_accelerations=np.empty(0))
    return replace(problem, settings=settings, limits=limits)


def refusals(problem: PlanningProblem, plan: Plan) -> tuple[Refusal, ...]:
    """Limits that a plan breaks, each with the cell in which it does so most; none if it can be carried out.

    Args:
        problem: What was asked, with the limits.
        plan: A plan that may have been made without them.
    """
    return tuple(_refusals(problem, plan))


def _refusals(problem: PlanningProblem, plan: Plan) -> Iterator[Refusal]:
    settings, transitions = problem.settings, plan.transitions
    least = usual_unit(problem.tree) * settings.min_clearance
    clear = [min(transition.neck, transition.inradius) for transition in transitions]
    if transitions[-1].inradius >= min(least, GOAL_REGION_FRACTION * problem.position_tolerance):
        clear[-1] = transitions[-1].neck
    yield from _broken(clear, -1, "planner.min_clearance", least, "m")
    times = [transition.estimated_time for transition in transitions]
    yield from _broken(times, 1, "planner.max_transition_time", settings.max_transition_time, "s")
    most = planned_accelerations(problem.limits)
    if most is not None:
        shares = estimated(plan)[2] / most
        axis = int(np.argmax(shares.max(axis=0)))
        limit = float(problem.limits.joint_accelerations[axis - 1])  # Of it, a share is planned with.
        values, joint = (limit * shares[:, axis]).tolist(), problem.tree.joints[axis - 1]
        unit: Unit = "rad/s^2" if joint.kind == "revolute" else "m/s^2"
        cell = int(np.argmax(shares[:, axis]))
        if shares[cell, axis] >= 1.0:  # The gains' limit acts, if it has not been left out.
            yield Refusal("limits.joint_accelerations", cell, values[cell], limit, unit, joint.name)


def _broken(values: Sequence[float], sign: int, limit: str, allowed: float, unit: Unit) -> Iterator[Refusal]:
    """The cell that breaks a limit most: from above with sign 1, from below with -1."""
    cell = max(range(len(values)), key=lambda k: sign * values[k])
    if sign * values[cell] > sign * allowed:
        yield Refusal(limit, cell, values[cell], allowed, unit)
