"""Check that a plan tolerates its budget: every stated set follows from those before it.

By induction over the transitions: from the stated entry set of each, no nominal motion is accelerated more
than stated; it ends settled as stated, where it counts as arrived; and the states in which the next cell can
then be entered lie in the stated set of that. No disturbance within the budget takes an axis farther from its
nominal motion than stated, and so no nearer to its funnel's bounds.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from coop_drake.answers.budget import Tolerance
from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.verification.budgets.axis_departure import departures
from coop_drake.verification.budgets.axis_law import Axes
from coop_drake.verification.budgets.entering import entering
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


def check_budget(plan: Plan) -> Check | None:
    """Check what a plan states about its budget; None for a plan without one.

    Raises:
        RefusalError: Names the transition, the entry and the axis.
    """
    if plan.budget is None or not plan.budget.axes:
        parts = {f"transitions[{k}].tolerance": one.tolerance for k, one in enumerate(plan.transitions)}
        for where, stated in (*parts.items(), ("axis_tracking", plan.axis_tracking)):
            if stated is not None:
                raise RefusalError(where, "is stated, but the plan has no budget for the axes")
        return None if plan.budget is None else Check("angles and joints are not part of the budget", 0)
    _check_departures(plan)
    smallest, count, entry = np.inf, 0, None
    for k, transition in enumerate(plan.transitions):
        stated, where = transition.tolerance, f"transitions[{k}]"
        assert stated is not None  # _check_departures has seen that
        if transition.gains.funnel != "quintic":
            raise RefusalError(
                f"{where}.gains.funnel", f"{transition.gains.funnel}: such a funnel never closes"
            )
        found = entry if entry is not None else _start(plan)
        _check_entry(stated, found, f"{where}.tolerance")
        entry = _check_transition(plan, k, stated, f"{where}.tolerance")  # of the next one
        smallest, count = min(smallest, float(stated.distance.min())), count + stated.distance.size
    return Check(
        "axes stay in their funnels under the budget", count, smallest, "rad or m to a funnel's bound"
    )


def _check_departures(plan: Plan) -> None:
    """Check how far axes and their rates may depart from their nominal motions."""
    stated = []
    for k, transition in enumerate(plan.transitions):
        if transition.tolerance is None:
            raise RefusalError(f"transitions[{k}].tolerance", "is missing, but the plan has a budget")
        stated.append(transition.tolerance)
    if plan.axis_tracking is None:
        raise RefusalError("axis_tracking", "is missing, but the plan has a budget")
    assert plan.budget is not None  # checked by the caller
    accelerations = np.array([one.acceleration for one in stated])
    stays = [max(one.gains.hand_over_time, one.gains.rest.after if one.gains.rest else 0.0)
             for one in plan.transitions]  # fmt: skip
    found = departures(plan.axis_tracking, plan.budget, accelerations, np.array(stays))
    for k, one in enumerate(stated):
        for name, values in zip(("departure", "rate_departure"), found[:2], strict=True):
            _require(getattr(one, name), values[k], False, f"transitions[{k}].tolerance.{name}")
        most = plan.transitions[k].gains.acceleration_limit
        if most is not None and not (one.acceleration + found[2][k] <= most).all():
            raise RefusalError(f"transitions[{k}].tolerance", "an axis may exceed its limit of acceleration")


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


def _axes(plan: Plan, k: int) -> Axes:
    cell, transition = plan.cells[k], plan.transitions[k]
    gains, same = transition.gains, np.ones_like(cell.lower)
    goal = np.array([transition.goal_lower, transition.goal_upper])
    single = (gains.position_gain, gains.rate_gain, gains.ramp_rate, gains.saturation)
    singles = (value * same for value in (*single, gains.hand_over_time))
    return Axes(np.array([cell.lower, cell.upper]), goal, gains.decay_rate, gains.log_gain, *singles)


def _check_transition(plan: Plan, k: int, stated: Tolerance, where: str) -> FloatArray:
    """Check one transition of the nominal motions; return in which states the next one can begin."""
    assert plan.budget is not None  # checked by the caller
    budget, axes, rest = plan.budget, _axes(plan, k), plan.transitions[k].gains.rest
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
    check_rate_room(plan.transitions[k], T, made, last, members, where)
    half = 0.5 * (axes.goal[1] - axes.goal[0])
    distance, fastest = half[members] - x - 0.125 * T * T * last, last.copy()
    for i, n in enumerate(samples):
        distance[i] = min(distance[i], made[:n, 5, i].min())
        fastest[i] = max(fastest[i], made[:n, 4, i].max())
    needed = np.maximum(needed, most)
    for name, found in (
        ("distance", -_largest(-distance, members) - stated.departure),
        ("acceleration", _largest(fastest, members)),
        ("settled", _largest(needed[0], members)),
        ("settled_rate", _largest(needed[1], members)),
    ):
        _require(getattr(stated, name), found, name == "distance", f"{where}.{name}")
    if rest is None:
        raise RefusalError(f"transitions[{k}].gains.rest", "is missing, but the plan has a budget")
    within = np.minimum(rest.reach, 2.0 * (0.5 - EROSION) * half)
    resting = (stated.settled <= within).all() and (stated.settled_rate <= rest.rate).all()
    if not (stated.distance > 0.0).all() or not resting:
        raise RefusalError(where, "an axis may leave its funnel, or never count as arrived")
    return entering(plan.transitions[k], budget, made, samples, members, last, rest, stated)


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
