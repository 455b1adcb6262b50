"""The gains of one transition, from a gain set and from the cell that the transition crosses."""

from __future__ import annotations

from math import sqrt

import numpy as np

from coop_drake.laws.funnels import Funnel, funnel_walls
from coop_drake.laws.gains import (
    FixedGains,
    FloatArray,
    GainSet,
    ScheduledGains,
    TransitionGains,
)
from coop_drake.laws.kernels import SATURATION
from coop_drake.laws.ppc import prescribed_energy


def transition_gains(
    gain_set: GainSet,
    *,
    neck: float,
    slice_lower: FloatArray,
    slice_upper: FloatArray,
    goal_lower: FloatArray,
    goal_upper: FloatArray,
    resting: FloatArray,
) -> TransitionGains:
    """Return the gains with which a transition is executed.

    Args:
        gain_set: Fixed gains, or the rule by which gains follow the cell.
        neck: b, widest clearance that a path to the target can keep inside the cell [m].
        slice_lower: Lower ends of the slice's axes (theta, q...), shape (m,) [rad or m].
        slice_upper: Upper ends, above the lower ones, shape (m,).
        goal_lower: Lower ends of the goal intervals, inside the slice, shape (m,).
        goal_upper: Upper ends, above the lower ones, shape (m,).
        resting: Where each axis rests when the transition begins: the middle of the previous goal interval,
            or the start; moved into the slice where it lies outside, shape (m,).

    Returns:
        Gains of the governor and of the funnels, and per axis the energy V below which the transition begins.

    Raises:
        ValueError: A slice or a goal interval is empty, or a goal interval leaves its slice; names the axis.
    """
    _check_intervals(slice_lower, slice_upper, goal_lower, goal_upper)
    width = slice_upper - slice_lower
    inside = np.clip(resting, slice_lower + SATURATION * width, slice_upper - SATURATION * width)
    shape = gain_set.funnel
    if isinstance(gain_set, FixedGains):
        stiffness, damping, governor_gain = gain_set.stiffness, gain_set.damping, gain_set.governor_gain
        decay_rate = np.full(width.shape, gain_set.joint_decay_rate)
        decay_rate[0] = gain_set.angle_decay_rate
        log_gain = np.full(width.shape, gain_set.log_gain)
    else:
        stiffness = stiffness_for_neck(gain_set, neck)
        damping = gain_set.damping_factor * sqrt(stiffness)
        governor_gain = gain_set.governor_factor * sqrt(stiffness)
        decay_rate = _decay_rate(gain_set, np.maximum(goal_lower - slice_lower, slice_upper - goal_upper))
        log_gain = _log_gain(gain_set, inside - slice_lower, slice_upper - inside)
    funnel = Funnel(slice_lower, slice_upper, goal_lower, goal_upper, decay_rate, shape)
    energy_at_rest = prescribed_energy(
        inside,
        np.zeros_like(width),
        funnel_walls(funnel, 0.0),
        log_gain=log_gain,
        position_gain=gain_set.position_gain,
    )
    return TransitionGains(
        stiffness=stiffness,
        damping=damping,
        governor_gain=governor_gain,
        smoothing=gain_set.smoothing,
        funnel=shape,
        decay_rate=decay_rate,
        log_gain=log_gain,
        position_gain=gain_set.position_gain,
        rate_gain=gain_set.rate_gain,
        energy_bound=gain_set.energy_factor * energy_at_rest + gain_set.energy_allowance * log_gain,
    )


def stiffness_for_neck(gain_set: ScheduledGains, neck: float) -> float:
    """Return K = clamp(wall_stiffness / b), the largest K where the neck closes [1/s^2]."""
    if neck * gain_set.max_stiffness <= gain_set.wall_stiffness:
        return gain_set.max_stiffness
    return max(gain_set.wall_stiffness / neck, gain_set.min_stiffness)


def _decay_rate(gain_set: ScheduledGains, shrink: FloatArray) -> FloatArray:
    """Return lambda = clamp(sqrt(acceleration / shrink)): a C1 wall starts with lambda^2 times its shrink."""
    slowest, fastest = gain_set.min_decay_rate, gain_set.max_decay_rate
    least_shrink = gain_set.funnel_acceleration / fastest**2
    rate: FloatArray = np.sqrt(gain_set.funnel_acceleration / np.maximum(shrink, least_shrink))
    return np.maximum(rate, slowest)


def _log_gain(gain_set: ScheduledGains, dl: FloatArray, du: FloatArray) -> FloatArray:
    """Return kappa, the largest with which the log term at rest stays below its acceleration."""
    pull = np.abs(np.log(dl / du)) * (dl + du) / (dl * du)
    least_pull = gain_set.log_acceleration / gain_set.max_log_gain
    kappa: FloatArray = gain_set.log_acceleration / np.maximum(pull, least_pull)
    return kappa


def _check_intervals(
    slice_lower: FloatArray, slice_upper: FloatArray, goal_lower: FloatArray, goal_upper: FloatArray
) -> None:
    """Refuse funnels that have no inside; rounding of a bound that the two intervals share is tolerated."""
    rounding = 1e-9 * (1.0 + np.abs(slice_lower) + np.abs(slice_upper))
    good = (slice_lower < slice_upper) & (goal_lower < goal_upper)
    good &= (goal_lower >= slice_lower - rounding) & (goal_upper <= slice_upper + rounding)
    if not np.all(good):
        axis = int(np.argmin(good))
        raise ValueError(
            f"axis {axis}: goal interval [{goal_lower[axis]}, {goal_upper[axis]}] must be inside "
            f"slice [{slice_lower[axis]}, {slice_upper[axis]}], and both longer than a point"
        )
