"""The gains of one transition, from a gain set and from the cell that the transition crosses."""

from __future__ import annotations

from math import inf, log, sqrt
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.funnels import axis_bounds
from coop_drake.laws.gains import FixedGains, FloatArray, GainSet, TransitionGains
from coop_drake.laws.ppc import SATURATION, track_axis

__all__ = ["Schedule", "schedule_of", "scheduled_axis", "scheduled_governor", "transition_gains"]


class Schedule(NamedTuple):
    """The rule by which gains follow the cell; in that of fixed gains, lower and upper bounds are equal.

    Attributes:
        wall_stiffness: K times the path's clearance b [m/s^2].
        min_stiffness: Smallest K [1/s^2].
        max_stiffness: Largest K [1/s^2].
        damping_factor: zeta over sqrt(K) [-].
        governor_factor: K_G over sqrt(K) [s].
        smoothing: c of the governor's root [m].
        smooth: Whether funnels are smooth.
        funnel_acceleration: Acceleration of a funnel bound aimed at [rad/s^2 or m/s^2].
        min_angle_rate: Smallest lambda of the object's angle [1/s].
        max_angle_rate: Largest lambda of the object's angle [1/s].
        min_joint_rate: Smallest lambda of a joint [1/s].
        max_joint_rate: Largest lambda of a joint [1/s].
        max_log_gain: Largest kappa [rad^2/s^2 or m^2/s^2].
        log_acceleration: Largest kappa |a s| when a transition is entered at rest [rad/s^2 or m/s^2].
        position_gain: k1 [1/s].
        rate_gain: k2 [1/s].
        energy_factor: A transition is entered below this multiple of the energy at rest ...
        energy_allowance: ... plus this multiple of kappa.
    """

    wall_stiffness: float
    min_stiffness: float
    max_stiffness: float
    damping_factor: float
    governor_factor: float
    smoothing: float
    smooth: bool
    funnel_acceleration: float
    min_angle_rate: float
    max_angle_rate: float
    min_joint_rate: float
    max_joint_rate: float
    max_log_gain: float
    log_acceleration: float
    position_gain: float
    rate_gain: float
    energy_factor: float
    energy_allowance: float


def schedule_of(gain_set: GainSet) -> Schedule:
    """Return the rule of a gain set."""
    if isinstance(gain_set, FixedGains):
        root = sqrt(gain_set.stiffness)
        stiffness = 0.0, gain_set.stiffness, gain_set.stiffness
        factors = gain_set.damping / root, gain_set.governor_gain / root
        rates = (*[gain_set.angle_decay_rate] * 2, *[gain_set.joint_decay_rate] * 2)
        acceleration, log_gains = 0.0, (gain_set.log_gain, inf)
    else:
        stiffness = gain_set.wall_stiffness, gain_set.min_stiffness, gain_set.max_stiffness
        factors = gain_set.damping_factor, gain_set.governor_factor
        rates = (gain_set.min_decay_rate, gain_set.max_decay_rate) * 2
        acceleration = gain_set.funnel_acceleration
        log_gains = gain_set.max_log_gain, gain_set.log_acceleration
    numbers = (*stiffness, *factors, gain_set.smoothing, acceleration, *rates, *log_gains)
    return Schedule._make(
        (
            *map(float, numbers[:6]),
            gain_set.funnel == "smooth",
            *map(float, numbers[6:]),
            float(gain_set.position_gain),
            float(gain_set.rate_gain),
            float(gain_set.energy_factor),
            float(gain_set.energy_allowance),
        )
    )


@compiled
def scheduled_governor(schedule: Schedule, clearance: float) -> tuple[float, float, float]:
    """Return K, zeta and K_G of a transition: K = clamp(``wall_stiffness`` / b), the largest for b = 0.

    Args:
        schedule: The rule.
        clearance: b, largest clearance that a path to the target can keep inside the cell [m].

    Returns:
        K [1/s^2], zeta = ``damping_factor`` sqrt(K) [1/s] and K_G = ``governor_factor`` sqrt(K) [-].
    """
    stiffness = schedule.max_stiffness
    if clearance * stiffness > schedule.wall_stiffness:
        stiffness = max(schedule.wall_stiffness / clearance, schedule.min_stiffness)
    root = sqrt(stiffness)
    return stiffness, schedule.damping_factor * root, schedule.governor_factor * root


@compiled
def scheduled_axis(
    schedule: Schedule,
    is_joint: bool,
    slice_lower: float,
    slice_upper: float,
    goal_lower: float,
    goal_upper: float,
    resting: float,
) -> tuple[float, float, float]:
    """Return lambda, kappa and the energy bound of one axis.

    lambda = clamp(sqrt(``funnel_acceleration`` / shrink)), shrink being the distance that the faster bound
    moves: a smooth bound starts with the acceleration lambda^2 times its shrink. kappa is the largest gain,
    up to ``max_log_gain``, with which the log term kappa |a s| at rest stays below ``log_acceleration``; a
    and s are those of ``track_axis`` in ``ppc.py``.
    The bound on V is ``energy_factor`` times the energy at rest, plus ``energy_allowance`` times kappa.

    Args:
        schedule: The rule.
        is_joint: Whether the axis is a joint, not the object's angle.
        slice_lower: Lower end of the slice [rad or m].
        slice_upper: Upper end of the slice [rad or m].
        goal_lower: Lower end of the goal interval [rad or m].
        goal_upper: Upper end of the goal interval [rad or m].
        resting: Where the axis rests when the transition begins; moved into the slice if outside [rad or m].

    Returns:
        lambda [1/s], kappa [rad^2/s^2 or m^2/s^2], largest V [rad^2/s^2 or m^2/s^2].
    """
    slowest, fastest = schedule.min_angle_rate, schedule.max_angle_rate
    if is_joint:
        slowest, fastest = schedule.min_joint_rate, schedule.max_joint_rate
    shrink, rate = max(goal_lower - slice_lower, slice_upper - goal_upper), fastest
    if shrink * fastest * fastest > schedule.funnel_acceleration:
        rate = max(sqrt(schedule.funnel_acceleration / shrink), slowest)
    width = slice_upper - slice_lower
    inside = min(max(resting, slice_lower + SATURATION * width), slice_upper - SATURATION * width)
    dl, du = inside - slice_lower, slice_upper - inside
    pull, log_gain = abs(log(dl / du)) * (dl + du) / (dl * du), schedule.max_log_gain
    if pull * log_gain > schedule.log_acceleration:
        log_gain = schedule.log_acceleration / pull
    bounds = axis_bounds(0.0, slice_lower, slice_upper, goal_lower, goal_upper, rate, schedule.smooth)
    at_rest = track_axis(inside, 0.0, bounds, log_gain, schedule.position_gain, 0.0)[1]
    return rate, log_gain, schedule.energy_factor * at_rest + schedule.energy_allowance * log_gain


def transition_gains(
    gain_set: GainSet,
    *,
    clearance: float,
    slice_lower: FloatArray,
    slice_upper: FloatArray,
    goal_lower: FloatArray,
    goal_upper: FloatArray,
    resting: FloatArray,
) -> TransitionGains:
    """Return the gains with which a transition is executed.

    Args:
        gain_set: Fixed gains, or the rule by which gains follow the cell.
        clearance: b, largest clearance that a path to the target can keep inside the cell [m].
        slice_lower: Lower ends of the slice's axes (theta, q...), shape (m,) [rad or m].
        slice_upper: Upper ends, above the lower ones, shape (m,).
        goal_lower: Lower ends of the goal intervals, inside the slice, shape (m,).
        goal_upper: Upper ends, above the lower ones, shape (m,).
        resting: Where each axis rests when the transition begins: the middle of the previous goal interval,
            or the start; moved into the slice where it lies outside, shape (m,).

    Returns:
        Gains of the governor and of the funnels, and for each axis the energy V below which the transition
        begins.

    Raises:
        ValueError: A slice or a goal interval is empty, or a goal interval leaves its slice; names the axis.
    """
    _check_intervals(slice_lower, slice_upper, goal_lower, goal_upper)
    schedule = schedule_of(gain_set)
    stiffness, damping, governor_gain = scheduled_governor(schedule, float(clearance))
    if isinstance(gain_set, FixedGains):  # as given, not by way of the root of K
        damping, governor_gain = float(gain_set.damping), float(gain_set.governor_gain)
    axes = np.transpose([slice_lower, slice_upper, goal_lower, goal_upper, resting]).astype(float)
    rows = np.array([scheduled_axis(schedule, i > 0, *axis) for i, axis in enumerate(axes)])
    return TransitionGains(
        stiffness=stiffness,
        damping=damping,
        governor_gain=governor_gain,
        smoothing=gain_set.smoothing,
        funnel=gain_set.funnel,
        decay_rate=rows[:, 0].copy(),
        log_gain=rows[:, 1].copy(),
        position_gain=gain_set.position_gain,
        rate_gain=gain_set.rate_gain,
        energy_bound=rows[:, 2].copy(),
    )


def _check_intervals(
    slice_lower: FloatArray, slice_upper: FloatArray, goal_lower: FloatArray, goal_upper: FloatArray
) -> None:
    """Refuse funnels without an interior; rounding of a bound that the two intervals share is tolerated."""
    rounding = 1e-9 * (1.0 + np.abs(slice_lower) + np.abs(slice_upper))
    good = (slice_lower < slice_upper) & (goal_lower < goal_upper)
    good &= (goal_lower >= slice_lower - rounding) & (goal_upper <= slice_upper + rounding)
    if not np.all(good):
        axis = int(np.argmin(good))
        raise ValueError(
            f"axis {axis}: goal interval [{goal_lower[axis]}, {goal_upper[axis]}] must be inside "
            f"slice [{slice_lower[axis]}, {slice_upper[axis]}], and both longer than a point"
        )
