"""Check by the log of a run that the object and the axes used no more than their plan's budget allows.

The nominal motion is not in the log. It follows from p_G alone, which is at rest between samples: from the
start at rest it is carried from sample to sample as an oscillator about p_G.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import nan

import numpy as np
import shapely

from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.verification.budgets.position_loop import oscillator
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.rows import Rows

SAME_TIME = 1e-9
"""Times that differ by less are those of one instant [s]."""

ROUNDING = 1e-9
"""Distances that are computed twice may differ by so much [m]."""


def check_budget_used(rows: Rows) -> list[Check]:
    """Check what a plan's budget states against the run; nothing for a plan without a budget."""
    plan = rows.plan
    if plan.budget is None or plan.tube is None:
        return []
    checks = [_check_tube(rows, plan.tube.radius, plan.tube.speed)]
    if plan.budget.axes:
        checks.append(_check_distances(rows))
    return checks


def budget_share(rows: Rows) -> float:
    """Return the largest share that a run used of what its plan's budget states [-]; NaN without a budget.

    That of the position is its distance from the nominal motion over the tube's radius. That of an axis is
    the least distance to its funnel's bounds that the budget states over the one that the axis kept.

    Raises:
        RefusalError: The log does not have all samples that the nominal motion depends on.
    """
    plan = rows.plan
    if plan.budget is None or plan.tube is None:
        return nan
    share = float(_off_nominal(rows, *_samples(rows))[1].max() / plan.tube.radius)
    if plan.budget.axes:
        for _, stated, kept in _distances(rows):
            with np.errstate(divide="ignore"):
                share = max(share, float(np.max(stated / np.maximum(kept, 0.0))))
    return share


def _samples(rows: Rows) -> tuple[IntArray, FloatArray, IntArray]:
    """Return of every row the sample before it and the time since then [s], and the samples' first rows."""
    times, period = rows.log.times, rows.plan.budget.period if rows.plan.budget else nan
    sample = np.floor(times / period + SAME_TIME / period).astype(np.int64)
    late = times - sample * period
    first = np.flatnonzero(np.abs(late) <= SAME_TIME)
    known = np.isin(sample, sample[first]) & (np.diff(sample, prepend=0) <= 1)
    rows.require(known, "times", "is not in a period whose first instant is in the log, too")
    return sample, late, first


def _off_nominal(
    rows: Rows, sample: IntArray, late: FloatArray, first: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return the nominal position in every row, (T, 2), and the object's distance from it, (T,) [m]."""
    nominal = _nominal(rows, rows.log.governor_position[first], first, sample, late)
    return nominal, np.hypot(*(rows.log.object_pose[:, :2] - nominal).T)


def _check_tube(rows: Rows, radius: float, speed: float) -> Check:
    """Check p_G at every sample, and the object's distance from its nominal motion in every row."""
    log, plan = rows.log, rows.plan
    assert plan.budget is not None  # checked by the caller
    sample, late, first = _samples(rows)
    p_G = log.governor_position[first]
    steps = np.hypot(*np.diff(p_G, axis=0, prepend=p_G[:1]).T)
    text = "moved by {:.6g} m in a period, beyond the plan's largest speed"
    within = np.ones(len(log.times), dtype=np.bool_)
    within[first] = steps <= plan.budget.period * speed + ROUNDING
    moved = np.zeros(len(log.times))
    moved[first] = steps
    rows.require(within, "governor_position", text, moved)
    nominal, off = _off_nominal(rows, sample, late, first)
    for k in range(len(plan.cells)):
        inside = (log.cell_index != k) | shapely.contains_xy(plan.governed(k), nominal[:, 0], nominal[:, 1])
        rows.require(inside, "governor_position", f"has led the nominal motion out of the region of cell {k}")
    rows.require(off <= radius + ROUNDING, "object_pose", "is {:.6g} m from its nominal position", off)
    return Check(
        "the object stayed in the tube of its budget",
        len(log.times),
        float(off.max() / radius),
        "of its radius used",
    )


def _nominal(rows: Rows, p_G: FloatArray, first: IntArray, sample: IntArray, late: FloatArray) -> FloatArray:
    """Return the nominal position in every row, shape (T, 2) [m]."""
    plan, gains = rows.plan, rows.plan.transitions[0].gains
    assert plan.budget is not None  # checked by the caller
    flow = oscillator(gains.stiffness, gains.damping, plan.budget.period)
    states = np.empty((len(first), 2, 2))  # sample; p^ - p_G and p^'; coordinates
    state = np.array([plan.start[:2] - p_G[0], np.zeros(2)])
    for i in range(len(first)):
        states[i] = state
        state = flow @ state
        state[0] -= p_G[min(i + 1, len(first) - 1)] - p_G[i]
    positions = np.empty((len(sample), 2))
    at = np.searchsorted(sample[first], sample)
    for row, (i, time) in enumerate(zip(at, late, strict=True)):
        carried = (
            states[i] if time <= SAME_TIME else oscillator(gains.stiffness, gains.damping, time) @ states[i]
        )
        positions[row] = p_G[i] + carried[0]
    return positions


def _distances(rows: Rows) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
    """Yield of every cell with a budget its rows, the stated distances, (1 + n,), and those kept there."""
    log, axes = rows.log, rows.z[:, 2:]
    kept = np.minimum(axes - log.funnel_lower, log.funnel_upper - axes)
    for k, transition in enumerate(rows.plan.transitions):
        inside = np.flatnonzero(log.cell_index == k)
        if transition.tolerance is not None and len(inside):
            yield inside, transition.tolerance.distance, kept[inside]


def _check_distances(rows: Rows) -> Check:
    """Check that every axis kept the distance to its funnel's bounds that the budget states."""
    spare = np.full((len(rows.log.times), rows.z.shape[1] - 2), np.inf)
    for inside, stated, kept in _distances(rows):
        spare[inside] = kept - stated
    rows.require(spare >= -ROUNDING, "angle, joints", "is {:.6g} nearer to a bound than stated", -spare)
    least = float(spare.min())
    return Check("axes kept the distances that the budget states", spare.size, least, "rad or m to spare")
