"""Gains: the sets that a scenario may select, and those that follow from a cell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, log, sqrt
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.jit import compiled
from coop_drake.laws.ppc import (
    CLOSING,
    PEAK_RATE,
    SATURATION,
    FunnelShape,
    axis_bounds,
    check_intervals,
    ramped_gain,
    shortest_hand_over,
    slowed_decay_rate,
    track_axis,
)
from coop_drake.tree.arrays import FloatArray
from coop_drake.typed_data import (
    EXACT,
    TAGGED,
    Bounds,
    Codec,
    DataError,
    Limits,
    NotNegative,
    Positive,
    check_fields,
)

# Gain sets: fixed gains (the paper's Table 2) or scheduled by cell; and the gains of one transition.

IDEAL_AGE = 0.015
"""Smallest age for which gains are scheduled [s]. An ideal team could take larger gains: on the shipped
scenarios they make the transport no quicker, and its forces larger."""

Saturation = Annotated[float, Limits(above=0.0, below=0.5)]
"""A distance to a funnel bound over the funnel's width; the middle is at one half [-]."""

EnergyFactor = Annotated[float, Limits(at_least=1.0)]
"""A multiple of the energy at rest; below 1 no transition could begin [-]."""

Gain = Annotated[Positive, EXACT]
"""A gain of one transition, of any size: it may be a product of numbers of a gain set."""

AxisGains = Annotated[FloatArray, Codec(tuple[Gain, ...], np.array, np.ndarray.tolist)]
"""Gains of one transition, one for each of the axes (theta, q...), shape (1 + n,)."""


@dataclass(frozen=True)
class TransitionGains:
    """Gains of one transition; per-axis arrays are ordered (theta, q...).

    Attributes:
        stiffness: K of (14) [1/s^2].
        damping: zeta of (14) [1/s].
        governor_gain: K_G of (14) [-].
        smoothing: c of the smoothed square root sqrt(x + c^2) - c; 0 gives the printed root [m].
        funnel: ``exponential`` as printed in (17), or ``quintic`` (C2 at both ends, closed after 5/lambda).
        decay_rate: lambda of (17), (39), shape (1 + n,) [1/s].
        log_gain: kappa, gain of the log term of (18), shape (1 + n,) [rad^2/s^2 or m^2/s^2].
        position_gain: k1 of (18)-(20), in the limit where it is ramped in [1/s].
        rate_gain: k2 of (18) [1/s].
        ramp_rate: mu of ``ramped_gain``, the rate at which k1 is ramped in; 0 for k1 at once, as
            printed [1/s].
        saturation: Smallest distance to a funnel bound with which the law computes, over the funnel's width
            [-]; see ``track_axis``.
        hand_over_time: T, in which the commands of the last cell fade; 0 for a step, as printed [s].
        energy_bound: Largest PPC energy V accepted when this transition is entered, shape (1 + n,).
        speed_limit: Largest speed of the object's origin; null for none [m/s].
        rate_limit: Largest rate of every axis; null for none, shape (1 + n,) [rad/s or m/s].
        limit_gain: g, the rate at which an axis may approach its limit; null without limits [1/s].
        acceleration_limit: Largest acceleration that is commanded of every axis; null for none, shape
            (1 + n,) [rad/s^2 or m/s^2].
    """

    stiffness: Gain
    damping: Gain
    governor_gain: Gain
    smoothing: Annotated[NotNegative, EXACT]
    funnel: FunnelShape
    decay_rate: AxisGains
    log_gain: AxisGains
    position_gain: Gain
    rate_gain: Gain
    ramp_rate: Annotated[NotNegative, EXACT]
    saturation: Annotated[Saturation, EXACT]
    hand_over_time: Annotated[NotNegative, EXACT]
    energy_bound: AxisGains
    speed_limit: Gain | None = None
    rate_limit: Bounds | None = None
    limit_gain: Gain | None = None
    acceleration_limit: Bounds | None = None

    def governor_row(self, before: TransitionGains) -> FloatArray:
        """Return the governor's gains as compiled code reads them, see ``governed_gains``, shape (9,).

        Args:
            before: Gains of the cell before; in the first cell its own.
        """
        own, limit = (self.stiffness, self.damping, self.governor_gain, self.smoothing), self.speed_limit
        first = before.stiffness, before.damping, before.governor_gain
        return np.array([*own, *first, self.hand_over_time, inf if limit is None else limit])

    def select(self, axes: NDArray[np.intp]) -> TransitionGains:
        """Return the same gains for some axes only, for instance those that one robot controls."""
        return replace(
            self,
            decay_rate=self.decay_rate[axes],
            log_gain=self.log_gain[axes],
            energy_bound=self.energy_bound[axes],
            rate_limit=None if self.rate_limit is None else self.rate_limit[axes],
            acceleration_limit=None if self.acceleration_limit is None else self.acceleration_limit[axes],
        )

    def limits_of(self, axis: int) -> tuple[float, float, float]:
        """Return the largest rate of an axis [rad/s or m/s], g [1/s], and its largest acceleration.

        Infinity where there is no limit.
        """
        rate, most = (inf, 0.0), inf
        if self.rate_limit is not None and self.limit_gain is not None:
            rate = float(self.rate_limit[axis]), self.limit_gain
        if self.acceleration_limit is not None:
            most = float(self.acceleration_limit[axis])
        return *rate, most


@dataclass(frozen=True)
class FixedGains:
    """One set of gains for every transition; the defaults are the paper's Table 2.

    Table 2 names lambda, k1 and k2 for the angle, and lambda alone for the joints: (38) as printed has no
    gains there, which is k1 = k2 = 1, the angle's values. kappa is 1 because (18) and (38) have no factor.

    Attributes:
        stiffness: K [1/s^2].
        damping: zeta [1/s].
        governor_gain: K_G [-].
        smoothing: c of the governor's root; 0 is the printed root [m].
        funnel: Law of the funnels.
        angle_decay_rate: lambda of the object's angle [1/s].
        joint_decay_rate: lambda of every joint [1/s].
        log_gain: kappa [rad^2/s^2 or m^2/s^2].
        position_gain: k1 [1/s].
        rate_gain: k2 [1/s].
        limit_gain: g, the rate at which an axis may approach a limit of its rate [1/s].
        ramp_rate: mu, the rate at which k1 is ramped in; 0 for k1 at once [1/s].
        saturation: Smallest distance to a funnel bound with which the law computes, over the width [-].
        hand_over_time: T, in which the commands of the last cell fade; 0 for a step, as printed [s].
        energy_factor: Largest energy with which a transition is entered, over the energy at rest.
        energy_allowance: Energy that is added to this limit, over kappa.
    """

    stiffness: Positive = 50.0
    damping: Positive = 5.0
    governor_gain: Positive = 5.0
    smoothing: NotNegative = 0.0
    funnel: FunnelShape = "exponential"
    angle_decay_rate: Positive = 2.0
    joint_decay_rate: Positive = 2.0
    log_gain: Positive = 1.0
    position_gain: Positive = 1.0
    rate_gain: Positive = 1.0
    limit_gain: Positive = 25.0
    ramp_rate: NotNegative = 0.0
    saturation: Saturation = SATURATION
    hand_over_time: NotNegative = 0.0
    energy_factor: EnergyFactor = 1.2
    energy_allowance: Positive = 0.5

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class ScheduledGains:
    """Rules by which gains follow the cell, and the age of the measurements on which efforts rest.

    An effort answers to a measurement that is as old as the delay, is held for a control period, and lags
    behind its command: on average its age is tau = delay + period / 2 + lag. Rate gains are bounded by a
    fraction of 1 / tau, and all others by the rate gain k2.

    Attributes:
        command_age: tau; null for that of ``deployment``, at least 15 ms [s].
        age_phase: k2 times tau, the phase by which the age turns the rate loop [rad].
        max_rate_gain: Largest k2 [1/s].
        position_fraction: k1 over k2 [-].
        ramp_fraction: mu over k2, the rate at which k1 is ramped in [-].
        wall_stiffness: K times the path's clearance b, K = clamp(wall_stiffness / b) [m/s^2].
        min_stiffness: Smallest K [1/s^2], unless the age allows less.
        max_stiffness: Largest K [1/s^2]; also at most (age_phase / tau)^2.
        damping_factor: zeta over sqrt(K) [-].
        governor_factor: K_G over sqrt(K) [s].
        smoothing: c of the governor's root [m].
        funnel_acceleration: Largest acceleration of a funnel bound, for which lambda is chosen [rad/s^2 or
            m/s^2].
        goal_acceleration: Largest acceleration of a funnel bound over k2^2 and the goal interval's width [-].
        turning_coupling: Largest acceleration of a joint without commands, over the square of the turn rate
            of the object [-].
        turning_acceleration: Largest such acceleration over k2^2 and the width of the joint's goal interval
            [-].
        min_decay_rate: Smallest lambda [1/s].
        decay_fraction: Largest lambda over k2 [-].
        max_log_gain: Largest kappa [rad^2/s^2 or m^2/s^2].
        log_fraction: Largest stiffness 16 kappa / w^2 of the log term over k2^2, in a goal interval's middle,
            w its width [-].
        log_acceleration: Largest kappa |a s| when a transition is entered at rest [rad/s^2 or m/s^2].
        saturation: Smallest distance to a funnel bound with which the law computes, over the width [-].
        hand_over_time: T, in which the commands of the last cell fade; longer if K must fall far [s].
        energy_factor: Largest energy with which a transition is entered, over the energy at rest.
        energy_allowance: Energy that is added to this limit, over kappa.
        entry_rate: A rate v whose energy v^2 / 2 is added as well [rad/s or m/s].
    """

    command_age: Positive | None = None
    age_phase: Positive = 0.4
    max_rate_gain: Positive = 60.0
    position_fraction: Positive = 0.4
    ramp_fraction: Positive = 0.3
    wall_stiffness: Positive = 20.0
    min_stiffness: Positive = 50.0
    max_stiffness: Positive = 150.0
    damping_factor: Positive = 1.4
    governor_factor: Positive = 1.2
    smoothing: NotNegative = 0.001
    funnel_acceleration: Positive = 12.0
    goal_acceleration: Positive = 0.3
    turning_coupling: Positive = 12.0
    turning_acceleration: Positive = 0.4
    min_decay_rate: Positive = 1.5
    decay_fraction: Positive = 0.5
    max_log_gain: Positive = 0.1
    log_fraction: Positive = 0.3
    log_acceleration: Positive = 5.0
    saturation: Saturation = 0.02
    hand_over_time: Positive = 0.1
    energy_factor: EnergyFactor = 1.2
    energy_allowance: Positive = 0.5
    entry_rate: Positive = 0.02

    def __post_init__(self) -> None:
        check_fields(self)
        if self.min_stiffness > self.max_stiffness:
            allowed = f"at most max_stiffness, {self.max_stiffness:g}"
            raise DataError("min_stiffness", self.min_stiffness, allowed)

    @property
    def age(self) -> float:
        """The age for which gains are scheduled [s]."""
        return IDEAL_AGE if self.command_age is None else self.command_age

    def slowed(self, factor: float) -> ScheduledGains:
        """Return the rules for commands that are older by a factor [-], which makes motions slower."""
        return self if factor == 1.0 else replace(self, command_age=factor * self.age)

    def for_age(self, age: float) -> ScheduledGains:
        """Return the rules for a team whose efforts rest on measurements of an age [s].

        A ``command_age`` that is given stays.
        """
        given = self.command_age is not None
        return self if given or age <= IDEAL_AGE else replace(self, command_age=age)


GainSet = Annotated[FixedGains | ScheduledGains, TAGGED]


# The gains of one transition, from a gain set and from the cell that the transition crosses.

PEAK = 10.0 / sqrt(3.0) / CLOSING**2
"""Largest acceleration of a quintic bound over lambda^2 times the distance that it moves [-]: 10 / sqrt(3) is
the largest second derivative of the quintic over u."""

ACCELERATION_SHARE = 0.4
"""Share of an acceleration limit that bounds, the log term at rest and the rate at entry take each [-]."""


class Schedule(NamedTuple):
    """The rule by which gains follow the cell; in that of fixed gains, lower and upper bounds are equal.

    Attributes:
        wall_stiffness: K times the path's clearance b [m/s^2].
        min_stiffness: Smallest K [1/s^2].
        max_stiffness: Largest K [1/s^2].
        damping_factor: zeta over sqrt(K) [-].
        governor_factor: K_G over sqrt(K) [s].
        smoothing: c of the governor's root [m].
        quintic: Whether funnels are quintic.
        funnel_acceleration: Largest acceleration of a funnel bound [rad/s^2 or m/s^2].
        goal_acceleration: The same over the goal interval's width [1/s^2].
        turning_rate: Largest rate of a bound of the object's angle, over the root of the narrowest goal
            interval of a joint [1/s].
        min_angle_rate: Smallest lambda of the object's angle [1/s].
        max_angle_rate: Largest lambda of the object's angle [1/s].
        min_joint_rate: Smallest lambda of a joint [1/s].
        max_joint_rate: Largest lambda of a joint [1/s].
        max_log_gain: Largest kappa [rad^2/s^2 or m^2/s^2].
        log_stiffness: Largest stiffness 16 kappa / w^2 of the log term in the middle of the goal interval, of
            width w [1/s^2].
        log_acceleration: Largest kappa |a s| when a transition is entered at rest [rad/s^2 or m/s^2].
        position_gain: k1 [1/s].
        rate_gain: k2 [1/s].
        limit_gain: g, the rate at which an axis may approach the limit of its rate [1/s].
        ramp_rate: mu [1/s].
        saturation: Smallest distance to a funnel bound, over the funnel's width [-].
        hand_over_time: T, in which the commands of the last cell fade [s].
        energy_factor: A transition is entered below this multiple of the energy at rest ...
        energy_allowance: ... plus this multiple of kappa ...
        entry_energy: ... plus this energy.
    """

    wall_stiffness: float
    min_stiffness: float
    max_stiffness: float
    damping_factor: float
    governor_factor: float
    smoothing: float
    quintic: bool
    funnel_acceleration: float
    goal_acceleration: float
    turning_rate: float
    min_angle_rate: float
    max_angle_rate: float
    min_joint_rate: float
    max_joint_rate: float
    max_log_gain: float
    log_stiffness: float
    log_acceleration: float
    position_gain: float
    rate_gain: float
    limit_gain: float
    ramp_rate: float
    saturation: float
    hand_over_time: float
    energy_factor: float
    energy_allowance: float
    entry_energy: float


def schedule_of(gain_set: GainSet) -> Schedule:
    """Return the rule of a gain set."""
    return _fixed(gain_set) if isinstance(gain_set, FixedGains) else _by_age(gain_set)


def _fixed(gains: FixedGains) -> Schedule:
    root, stiffness = sqrt(gains.stiffness), float(gains.stiffness)
    angle, joint = float(gains.angle_decay_rate), float(gains.joint_decay_rate)
    return Schedule(
        wall_stiffness=0.0, min_stiffness=stiffness, max_stiffness=stiffness,
        damping_factor=gains.damping / root, governor_factor=gains.governor_gain / root,
        smoothing=float(gains.smoothing), quintic=gains.funnel == "quintic", funnel_acceleration=0.0,
        goal_acceleration=inf, turning_rate=inf,
        min_angle_rate=angle, max_angle_rate=angle, min_joint_rate=joint, max_joint_rate=joint,
        max_log_gain=float(gains.log_gain), log_stiffness=inf, log_acceleration=inf,
        position_gain=float(gains.position_gain), rate_gain=float(gains.rate_gain),
        limit_gain=float(gains.limit_gain), ramp_rate=float(gains.ramp_rate),
        saturation=float(gains.saturation),
        hand_over_time=float(gains.hand_over_time),
        energy_factor=float(gains.energy_factor), energy_allowance=float(gains.energy_allowance),
        entry_energy=0.0,
    )  # fmt: skip


def _by_age(gains: ScheduledGains) -> Schedule:
    """Return the rule for the age tau of commands: k2 = phase / tau, and K at most (phase / tau)^2.

    A rate loop with gain k2 crosses over at k2, where the age takes the phase k2 tau; the loop of the
    position, of stiffness K, crosses over near sqrt(K) or above and has the damping zeta.
    """
    fastest = gains.age_phase / gains.age
    rate_gain = min(fastest, float(gains.max_rate_gain))
    stiffness = min(float(gains.max_stiffness), fastest * fastest)
    slowest, quickest = float(gains.min_decay_rate), gains.decay_fraction * rate_gain
    rates = min(slowest, quickest), quickest
    least = min(float(gains.min_stiffness), stiffness)
    hand_over = shortest_hand_over(stiffness, least, gains.damping_factor * sqrt(least))
    return Schedule(
        wall_stiffness=float(gains.wall_stiffness), min_stiffness=least,
        max_stiffness=stiffness, damping_factor=float(gains.damping_factor),
        governor_factor=float(gains.governor_factor), smoothing=float(gains.smoothing), quintic=True,
        funnel_acceleration=float(gains.funnel_acceleration),
        goal_acceleration=gains.goal_acceleration * rate_gain * rate_gain,
        turning_rate=sqrt(gains.turning_acceleration / gains.turning_coupling) * rate_gain,
        min_angle_rate=rates[0], max_angle_rate=rates[1], min_joint_rate=rates[0], max_joint_rate=rates[1],
        max_log_gain=float(gains.max_log_gain), log_stiffness=gains.log_fraction * rate_gain * rate_gain,
        log_acceleration=float(gains.log_acceleration), position_gain=gains.position_fraction * rate_gain,
        rate_gain=rate_gain, limit_gain=rate_gain, ramp_rate=gains.ramp_fraction * rate_gain,
        saturation=float(gains.saturation), hand_over_time=max(float(gains.hand_over_time), hand_over),
        energy_factor=float(gains.energy_factor), energy_allowance=float(gains.energy_allowance),
        entry_energy=0.5 * gains.entry_rate * gains.entry_rate,
    )  # fmt: skip


@compiled(borrows=True)
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


@compiled(borrows=True)
def scheduled_axis(
    schedule: Schedule,
    is_joint: bool,
    slice_lower: float,
    slice_upper: float,
    goal_lower: float,
    goal_upper: float,
    resting: float,
    narrowest: float,
    rate_limit: float,
    acceleration_limit: float,
) -> tuple[float, float, float]:
    """Return lambda, kappa and the energy bound of one axis.

    lambda = clamp(sqrt(A / (``PEAK`` shrink))), shrink being the distance that the faster bound moves: the
    largest acceleration of a quintic bound is ``PEAK`` lambda^2 shrink. A is ``funnel_acceleration``, or less
    where the goal interval is narrow: an error of the model by a part of A must not fill it. Bounds of the
    angle move at most at ``turning_rate`` times the root of ``narrowest``, their largest rate being
    ``PEAK_RATE`` lambda shrink (docs/equations.md, "Turning and narrow joints"). Where a bound would be too
    fast for the axis's rate limit, lambda is smaller, see ``slowed_decay_rate``. The acceleration of bounds,
    the log term at rest and k2 sqrt(kappa), by which an axis brakes at entry, are at most
    ``ACCELERATION_SHARE`` of an acceleration limit. kappa is the largest gain, up to ``max_log_gain``, with
    which the log term kappa |a s| at rest stays below ``log_acceleration`` and its stiffness in the middle of
    the goal interval below ``log_stiffness``; a and s are those of ``track_axis`` in ``ppc.py``. The bound on
    V is ``energy_factor`` times the energy at rest, plus ``energy_allowance`` times kappa, plus
    ``entry_energy``.

    Args:
        schedule: The rule.
        is_joint: Whether the axis is a joint, not the object's angle.
        slice_lower: Lower end of the slice [rad or m].
        slice_upper: Upper end of the slice [rad or m].
        goal_lower: Lower end of the goal interval [rad or m].
        goal_upper: Upper end of the goal interval [rad or m].
        resting: Where the axis rests when the transition begins; moved into the slice if outside [rad or m].
        narrowest: Width of a joint's narrowest goal interval, infinity without joints; not used for a joint.
        rate_limit: Largest rate of the axis, infinity for none [rad/s or m/s].
        acceleration_limit: Its largest acceleration, infinity for none [rad/s^2 or m/s^2].

    Returns:
        lambda [1/s], kappa [rad^2/s^2 or m^2/s^2], largest V [rad^2/s^2 or m^2/s^2].
    """
    slowest, fastest = schedule.min_angle_rate, schedule.max_angle_rate
    if is_joint:
        slowest, fastest = schedule.min_joint_rate, schedule.max_joint_rate
    shrink, rate = max(goal_lower - slice_lower, slice_upper - goal_upper), fastest
    width, goal_width = slice_upper - slice_lower, goal_upper - goal_lower
    acceleration = min(schedule.funnel_acceleration, schedule.goal_acceleration * goal_width)
    if PEAK * shrink * fastest * fastest > acceleration:
        rate = max(sqrt(acceleration / (PEAK * shrink)), slowest)
    if not is_joint and PEAK_RATE * shrink * rate > schedule.turning_rate * sqrt(narrowest):
        rate = max(schedule.turning_rate * sqrt(narrowest) / (PEAK_RATE * shrink), slowest)
    rate = slowed_decay_rate(rate, shrink, schedule.quintic, rate_limit)
    share = ACCELERATION_SHARE * acceleration_limit
    if PEAK * shrink * rate * rate > share:
        rate = sqrt(share / (PEAK * shrink))
    near = schedule.saturation * width
    inside = min(max(resting, slice_lower + near), slice_upper - near)
    dl, du = inside - slice_lower, slice_upper - inside
    pull = abs(log(dl / du)) * (dl + du) / (dl * du)
    log_gain = min(schedule.max_log_gain, schedule.log_stiffness * goal_width * goal_width / 16.0)
    log_gain = min(log_gain, (share / schedule.rate_gain) ** 2)
    most = min(schedule.log_acceleration, share)
    if pull * log_gain > most:
        log_gain = most / pull
    bounds = axis_bounds(0.0, slice_lower, slice_upper, goal_lower, goal_upper, rate, schedule.quintic)
    k1, k1_dot = ramped_gain(0.0, schedule.position_gain, schedule.ramp_rate)
    at_rest = track_axis(inside, 0.0, bounds, (log_gain, k1, k1_dot, 0.0, schedule.saturation))[1]
    allowance = schedule.energy_allowance * log_gain + schedule.entry_energy
    return rate, log_gain, schedule.energy_factor * at_rest + allowance


def transition_gains(
    gain_set: GainSet,
    *,
    clearance: float,
    slice_lower: FloatArray,
    slice_upper: FloatArray,
    goal_lower: FloatArray,
    goal_upper: FloatArray,
    resting: FloatArray,
    speed_limit: float | None = None,
    rate_limit: FloatArray | None = None,
    acceleration_limit: FloatArray | None = None,
) -> TransitionGains:
    """Return the gains with which a transition is executed.

    Args:
        gain_set: Fixed gains, or the rule by which gains follow the cell.
        clearance: b, largest clearance that a path to the target can keep inside the cell [m].
        slice_lower: Lower ends of the slice's axes (theta, q...), shape (m,) [rad or m].
        slice_upper: Upper ends, above the lower ones, shape (m,).
        goal_lower: Lower ends of the goal intervals, inside the slice, shape (m,).
        goal_upper: Upper ends, above the lower ones, shape (m,).
        resting: Where each axis rests at the beginning, the middle of the last goal interval or the start;
            moved into the slice where it lies outside, shape (m,).
        speed_limit: Largest speed of the object's origin, None for none [m/s].
        rate_limit: Largest rate of every axis, infinity for none, shape (m,) [rad/s or m/s]; None for none.
        acceleration_limit: Largest acceleration of every axis in the same way, shape (m,).

    Returns:
        Gains of governor and funnels, and for each axis the energy V below which the transition begins.

    Raises:
        ValueError: A slice or a goal interval is empty, or a goal interval leaves its slice; names the axis.
    """
    check_intervals(slice_lower, slice_upper, goal_lower, goal_upper)
    schedule = schedule_of(gain_set)
    stiffness, damping, governor_gain = scheduled_governor(schedule, float(clearance))
    if isinstance(gain_set, FixedGains):  # as given, not by way of the root of K
        damping, governor_gain = float(gain_set.damping), float(gain_set.governor_gain)
    narrowest = np.full(len(resting), np.min(goal_upper[1:] - goal_lower[1:], initial=inf))
    limits = (narrowest + inf if most is None else most for most in (rate_limit, acceleration_limit))
    ends = slice_lower, slice_upper, goal_lower, goal_upper, resting, narrowest, *limits
    axes = np.transpose(ends).astype(float)
    rows = np.array([scheduled_axis(schedule, i > 0, *axis) for i, axis in enumerate(axes)])
    return TransitionGains(
        stiffness=stiffness,
        damping=damping,
        governor_gain=governor_gain,
        smoothing=schedule.smoothing,
        funnel="quintic" if schedule.quintic else "exponential",
        decay_rate=rows[:, 0].copy(),
        log_gain=rows[:, 1].copy(),
        position_gain=schedule.position_gain,
        rate_gain=schedule.rate_gain,
        ramp_rate=schedule.ramp_rate,
        saturation=schedule.saturation,
        hand_over_time=schedule.hand_over_time,
        energy_bound=rows[:, 2].copy(),
        speed_limit=speed_limit,
        rate_limit=rate_limit,
        limit_gain=None if rate_limit is None else schedule.limit_gain,
        acceleration_limit=acceleration_limit,
    )
