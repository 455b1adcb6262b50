"""Check that a plan tolerates its budget: every stated set follows from those before it.

By induction over the transitions: from the stated entry set of each, no nominal motion is accelerated more
than stated; it ends settled as stated, where it counts as arrived; and the states in which the next cell can
then be entered lie in the stated set of that. No disturbance within the budget takes an axis farther from its
nominal motion than stated, and so no nearer to its funnel's bounds.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from coop_drake.answers.budget import AxisTracking, Budget, Tolerance
from coop_drake.answers.plan import Plan, Transition
from coop_drake.errors import RefusalError
from coop_drake.tree import ComponentTree
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.verification.budgets.alarms import alarms_of, check_axis_alarms
from coop_drake.verification.budgets.axis_departure import Loop, departures, loop_of, resting
from coop_drake.verification.budgets.axis_law import Axes, axes_of
from coop_drake.verification.budgets.couplings import Coupled, couplings
from coop_drake.verification.budgets.efforts import (
    Asked,
    check_stated_efforts,
    commanded,
    nothing_given,
)
from coop_drake.verification.budgets.entering import entering, first_rest
from coop_drake.verification.budgets.rate_room import check_rate_room
from coop_drake.verification.budgets.staying import Closed, staying, tails
from coop_drake.verification.budgets.tubes import Nominal, tubes
from coop_drake.verification.checks import Check

ROUNDING = 1e-9
"""Differences that rounding explains, relative and absolute [rad or m, s]."""

EROSION = 0.1
"""Fraction of a goal interval at each end in which an axis does not count as arrived [-]."""

RAMPED = 6.0
"""mu t after which a gain counts as ramped in [-]; what is missing then counts as a disturbance."""


def check_budget(plan: Plan, tree: ComponentTree | None = None) -> Check | None:
    """Check what a plan states about its budget; None for a plan without one.

    Args:
        plan: The plan.
        tree: Its team, needed for a budget that has the team's bodies.

    Raises:
        RefusalError: Names the transition, the entry and the axis.
    """
    if plan.budget is None or not plan.budget.axes:
        parts = {f"transitions[{k}].tolerance": one.tolerance for k, one in enumerate(plan.transitions)}
        for where, stated in (*parts.items(), ("axis_tracking", plan.axis_tracking)):
            if stated is not None:
                raise RefusalError(where, "is stated, but the plan has no budget for the axes")
        return None if plan.budget is None else Check("angles and joints are not part of the budget", 0)
    loop, coupled, tracking = _loop(plan), _coupling(plan, tree), _tracking(plan)
    _check_friction(tracking, plan.budget, coupled)
    entered = resting(loop, plan.start.size - 2)
    smallest, count, entry, every = np.inf, 0, _start(plan), list[Asked]()
    given = nothing_given(loop, plan.start.size - 2)
    for k, transition in enumerate(plan.transitions):
        stated, where = transition.tolerance, f"transitions[{k}]"
        if stated is None:
            raise RefusalError(f"{where}.tolerance", "is missing, but the plan has a budget")
        if transition.gains.funnel != "quintic":
            raise RefusalError(
                f"{where}.gains.funnel", f"{transition.gains.funnel}: such a funnel never closes"
            )
        _check_entry(stated, entry, f"{where}.tolerance")
        motion, entry = _check_motion(plan, k, stated, f"{where}.tolerance")
        rates = coupled.rates[k, 1:]
        away, entered, flows = departures(loop, rates, motion.moving, entered, motion.leaving)
        _check_departures(transition, motion, away, tracking, f"{where}.tolerance")
        check_axis_alarms(alarms_of(plan), stated, plan.budget, tracking, f"{where}.tolerance")
        if plan.budget.limited:
            one, given = commanded(loop, motion.laws, motion.moving, flows, given, motion.leaving)
            every.append(one)
        smallest, count = min(smallest, float(stated.distance.min())), count + stated.distance.size
    if plan.budget.limited:
        assert tree is not None  # a budget with limits has bodies
        check_stated_efforts(plan, tree, every)
    return Check(
        "axes stay in their funnels under the budget", count, smallest, "rad or m to a funnel's bound"
    )


def _loop(plan: Plan) -> Loop:
    assert plan.budget is not None  # checked by the caller
    return loop_of(_tracking(plan), plan.budget)


def _tracking(plan: Plan) -> AxisTracking:
    """Return how axes are pulled to their nominal motions, with as many numbers as there must be."""
    tracking, budget = plan.axis_tracking, plan.budget
    if tracking is None:
        raise RefusalError("axis_tracking", "is missing, but the plan has a budget")
    axes, timed = plan.start.size - 2, budget is not None and (budget.clock_error or budget.joint_viscous)
    needed = {"rate": axes, "acceleration": axes} if timed else {"rate": 0, "acceleration": 0}
    needed["disturbance"] = 1 + axes if budget is not None and budget.rubs else 0
    for name, count in needed.items():
        if len(getattr(tracking, name)) != count:
            found = f"has {len(getattr(tracking, name))} numbers, not {count}"
            raise RefusalError(f"axis_tracking.{name}", found)
    return tracking


def _check_friction(tracking: AxisTracking, budget: Budget, coupled: Coupled) -> None:
    """Check how much friction accelerates the object's origin and the axes, with any sign in every joint.

    Viscous friction counts with the rates that axes never exceed, which is checked for every transition.
    """
    if not budget.rubs:
        return
    friction = budget.joint_coulomb + budget.joint_viscous * np.array(tracking.rate[1:] or 0.0)
    found = (coupled.efforts * friction).sum(axis=2).max(axis=0)
    _require(np.array(tracking.disturbance), found, False, "axis_tracking.disturbance")


def _coupling(plan: Plan, tree: ComponentTree | None) -> Coupled:
    """Return what the masses couple in every cell, nothing where the budget has no bodies."""
    assert plan.budget is not None  # checked by the caller
    axes = plan.start.size - 2
    if not plan.budget.bodies:
        rows = len(plan.cells), 1 + axes
        return Coupled(np.zeros((*rows, axes, axes)), np.zeros((*rows, 0, 2)), np.zeros((*rows, axes - 1)))
    if tree is None:
        raise ValueError("tree: expected the team, because the plan's budget has its bodies")
    if max(body[0] for body in plan.budget.bodies) >= len(tree.components):
        raise RefusalError("budget.bodies", f"expected components below {len(tree.components)}")
    if len(plan.budget.rotors) not in (0, axes - 1):
        raise RefusalError("budget.rotors", f"has {len(plan.budget.rotors)} numbers, not {axes - 1}")
    if len(plan.budget.dampings) not in (0, axes - 1):
        raise RefusalError("budget.dampings", f"has {len(plan.budget.dampings)} numbers, not {axes - 1}")
    if max((base[0] for base in plan.budget.bases), default=0) >= len(tree.components):
        raise RefusalError("budget.bases", f"expected components below {len(tree.components)}")
    return couplings(plan.budget, tree, plan.cells)


class _Motion(NamedTuple):
    """What follows for the nominal motions of a transition.

    Attributes:
        moving: Largest |acceleration| and rate in every period, the last one for ever, shape (periods + 1, 2,
            axes).
        spare: Least distance to the funnels' bounds in every period, likewise, shape (periods + 1, axes).
        leaving: The first sample at which the cell can be left.
        laws: Least and largest command of the law, likewise, shape (periods + 1, 2, axes).
    """

    moving: FloatArray
    spare: FloatArray
    leaving: int
    laws: FloatArray


def _check_departures(
    transition: Transition, motion: _Motion, away: FloatArray, tracking: AxisTracking, where: str
) -> None:
    """Check how far axes and their rates may depart from their nominal motions, and what this leaves."""
    stated, gains = transition.tolerance, transition.gains
    assert stated is not None  # checked by the caller
    for i, name in enumerate(("departure", "rate_departure")):
        _require(getattr(stated, name), away[:, i].max(axis=0), False, f"{where}.{name}")
    _require(stated.distance, (motion.spare - away[:, 0]).min(axis=0), True, f"{where}.distance")
    if not (stated.distance > 0.0).all():
        raise RefusalError(where, "an axis may leave its funnel")
    most, limits = gains.acceleration_limit, gains.rate_limit
    pushed, fastest = stated.acceleration + away[:, 2].max(axis=0), motion.moving[:, 1] + away[:, 1]
    if most is not None and not (pushed <= most).all():
        raise RefusalError(where, "an axis may exceed its limit of acceleration")
    if limits is not None and not (fastest.max(axis=0) <= limits).all():
        raise RefusalError(where, "an axis may be faster than its limit")
    if tracking.rate:
        _require(np.array(tracking.rate), fastest.max(axis=0), False, "axis_tracking.rate")
        _require(np.array(tracking.acceleration), pushed, False, "axis_tracking.acceleration")


def _start(plan: Plan) -> FloatArray:
    """Return the set of the start: at rest."""
    rest = np.zeros_like(plan.start[2:])
    return np.array([plan.start[2:], plan.start[2:], rest, rest, rest])


_ENTRY = (
    "entry_lower", "entry_upper", "entry_rate_lower", "entry_rate_upper", "entry_acceleration",
)  # fmt: skip


def _check_entry(stated: Tolerance, found: FloatArray, where: str) -> None:
    for name, value in zip(_ENTRY, found, strict=True):
        least = name in ("entry_lower", "entry_rate_lower")
        _require(getattr(stated, name), value, least, f"{where}.{name}")


def _require(stated: FloatArray, found: FloatArray, least: bool, where: str) -> None:
    """Refuse a stated bound that the found values exceed; ``least`` says that it is a lower one."""
    room = ROUNDING * (1.0 + np.abs(found))
    good = stated <= found + room if least else stated >= found - room
    if not good.all():
        axis = int(np.argmin(good))
        raise RefusalError(
            f"{where}[{axis}]", f"is {stated[axis]:.6g}; the budget gives {'down' if least else 'up'} to "
            f"{found[axis]:.6g}",
        )  # fmt: skip


def _check_motion(plan: Plan, k: int, stated: Tolerance, where: str) -> tuple[_Motion, FloatArray]:
    """Check one transition of the nominal motions; return in which states the next one can begin, too."""
    assert plan.budget is not None  # checked by the caller
    budget, axes, rest = plan.budget, axes_of(plan, k), plan.transitions[k].gains.rest
    members, middle, reach = _parts(stated)
    T, motions = budget.period, Nominal(axes[members], budget.period, budget.lag)
    ended = np.maximum(5.0 / axes.decay, np.where(axes.mu > 0.0, RAMPED / np.maximum(axes.mu, 1e-9), 0.0))
    begins = np.ceil(np.maximum(ended, axes.fading) / T).astype(int)[members]
    follows = tails(motions)
    samples = begins + follows + 1
    rests = plan.start[2:] if k == 0 else _middles(plan, k - 1)
    made = tubes(
        motions, int(samples.max()), middle, reach, stated.entry_acceleration[members], rests[members]
    )
    box, most = _ends(made, begins, samples, motions.axes)
    x, v = stated.settled[members], stated.settled_rate[members]
    needed, last = staying(motions, Closed(begins * T, follows, box, x, v))
    check_rate_room(plan.transitions[k], made, last, members, where)
    half = 0.5 * (axes.goal[1] - axes.goal[0])
    needed, fastest = np.maximum(needed, most), last.copy()
    for i, n in enumerate(samples):
        fastest[i] = max(fastest[i], made[:n, 4, i].max())
    for name, found in (
        ("acceleration", _largest(fastest, members)),
        ("settled", _largest(needed[0], members)),
        ("settled_rate", _largest(needed[1], members)),
    ):
        _require(getattr(stated, name), found, False, f"{where}.{name}")
    if rest is None:
        raise RefusalError(f"transitions[{k}].gains.rest", "is missing, but the plan has a budget")
    if not (rest.reach <= 2.0 * (0.5 - EROSION) * half * (1.0 + ROUNDING)).all():
        finding = f"is {rest.reach.tolist()}: an axis may count as at rest outside of its goal interval"
        raise RefusalError(f"transitions[{k}].gains.rest.reach", finding)
    if not ((stated.settled <= rest.reach).all() and (stated.settled_rate <= rest.rate).all()):
        raise RefusalError(where, "an axis may never count as arrived")
    ends = half[members] - x - 0.125 * T * T * last
    leaving = first_rest(plan.transitions[k], T, made, samples, members, rest)
    motion = _motion(made, samples, members, np.array([last, v, ends]), T, leaving)
    entered = entering(plan.transitions[k], budget, made, samples, members, last, rest, stated)
    return motion, entered


def _motion(
    made: FloatArray, samples: FloatArray, members: IntArray, ever: FloatArray, period: float, leaving: int
) -> _Motion:
    """Return what follows for all axes from the tubes of their parts.

    Args:
        made: The tubes, as ``tubes`` returns them.
        samples: How many samples of each tube there are, shape (b,).
        members: Axis of each tube, shape (b,).
        ever: Largest acceleration, rate, and least distance after each tube's end, shape (3, b).
        period: Control period [s].
        leaving: The first sample at which the cell can be left.
    """
    rows = np.repeat(ever[None], int(samples.max()) + 1, axis=0)
    laws = np.repeat(np.stack([-ever[:1], ever[:1]], axis=1), len(rows), axis=0)
    for i, n in enumerate(samples):
        tube = made[:n, :, i]
        rows[:n, :, i] = np.column_stack([tube[:, 4], np.abs(tube[:, 2]) + tube[:, 3], tube[:, 5]])
        laws[:n, :, i] = np.column_stack([tube[:, 6] - tube[:, 7], tube[:, 6] + tube[:, 7]])
    commands = [laws[:, :, members == axis] for axis in range(int(members.max()) + 1)]
    bounds = np.stack([[own[:, 0].min(axis=1), own[:, 1].max(axis=1)] for own in commands], axis=2)
    axes = [rows[:, :, members == axis] for axis in range(int(members.max()) + 1)]
    moving = np.stack([own[:, :2].max(axis=2) for own in axes], axis=2)
    moving[:, 1] += period * moving[:, 0]
    spare = np.stack([own[:, 2].min(axis=1) for own in axes], axis=1)
    return _Motion(moving, spare, leaving, bounds.transpose(1, 0, 2))


def _middles(plan: Plan, k: int) -> FloatArray:
    """Return the middles of the goal intervals of a transition."""
    middles: FloatArray = 0.5 * (plan.transitions[k].goal_lower + plan.transitions[k].goal_upper)
    return middles


def _parts(stated: Tolerance) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return whose every part of an entry set is, shape (b,), its middle and its reach, shape (2, b)."""
    members, middles, reaches = [], [], []
    for axis, parts in enumerate(stated.entry_parts):
        ends = np.linspace(stated.entry_lower[axis], stated.entry_upper[axis], parts + 1)
        rates = stated.entry_rate_lower[axis], stated.entry_rate_upper[axis]
        for low, high in pairwise(ends):
            members.append(axis)
            middles.append((0.5 * (low + high), 0.5 * (rates[0] + rates[1])))
            reaches.append((0.5 * (high - low), 0.5 * (rates[1] - rates[0])))
    return np.array(members, dtype=np.intp), np.array(middles).T, np.array(reaches).T


def _ends(
    made: FloatArray, begins: FloatArray, samples: FloatArray, axes: Axes
) -> tuple[FloatArray, FloatArray]:
    """Return the departures from the goal intervals' middles when funnels are closed, and the largest after.

    The first are those of x, v and acceleration, shape (3, b); the others those of x and v, shape (2, b).
    """
    box, most = np.empty((3, samples.size)), np.empty((2, samples.size))
    middle = 0.5 * (axes.goal[0] + axes.goal[1])
    for i, (begin, end) in enumerate(zip(begins, samples, strict=True)):
        late = made[begin:end, :, i]
        x, v = np.abs(late[:, 0] - middle[i]) + late[:, 1], np.abs(late[:, 2]) + late[:, 3]
        box[:, i], most[:, i] = (x[0], v[0], late[0, 4]), (x.max(), v.max())
    return box, most


def _largest(values: FloatArray, members: IntArray) -> FloatArray:
    return np.array([values[members == axis].max() for axis in range(int(members.max()) + 1)])
