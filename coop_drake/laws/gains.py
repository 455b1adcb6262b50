"""Gain sets: fixed gains (the paper's Table 2) or scheduled by cell; and the gains of one transition."""

from dataclasses import dataclass, replace
from math import inf
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from coop_drake.tree.pose import FloatArray
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

FunnelShape = Literal["exponential", "quintic"]

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
class RestCondition:
    """When a cell may be left, and where every axis must be then, and how slow; arrays of shape (1 + n,).

    Attributes:
        after: Time since the cell was entered, at least that of the hand-over [s].
        reach: Largest distance from the middle of the goal interval [rad or m].
        rate: Largest magnitude of the rate [rad/s or m/s].
    """

    after: Annotated[NotNegative, EXACT]
    reach: AxisGains
    rate: AxisGains


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
        rest: When this transition may be left, in place of the next one's energy bound; null where that bound
            decides.
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
    rest: RestCondition | None = None
    speed_limit: Gain | None = None
    rate_limit: Bounds | None = None
    limit_gain: Gain | None = None
    acceleration_limit: Bounds | None = None

    def governor_row(self, before: "TransitionGains") -> FloatArray:
        """Return the governor's gains as compiled code reads them, see ``governed_gains``, shape (9,).

        Args:
            before: Gains of the cell before; in the first cell its own.
        """
        own, limit = (self.stiffness, self.damping, self.governor_gain, self.smoothing), self.speed_limit
        first = before.stiffness, before.damping, before.governor_gain
        return np.array([*own, *first, self.hand_over_time, inf if limit is None else limit])

    def with_governor(self, stiffness: float, damping: float, governor_gain: float) -> "TransitionGains":
        """Return the same gains with another K [1/s^2], zeta [1/s] and K_G [-]."""
        return replace(self, stiffness=stiffness, damping=damping, governor_gain=governor_gain)

    def select(self, axes: NDArray[np.intp]) -> "TransitionGains":
        """Return the same gains for some axes only, for instance those that one robot controls."""
        return replace(
            self,
            decay_rate=self.decay_rate[axes],
            log_gain=self.log_gain[axes],
            energy_bound=self.energy_bound[axes],
            rest=self.rest and replace(self.rest, reach=self.rest.reach[axes], rate=self.rest.rate[axes]),
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
    saturation: Saturation = 1e-7
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

    def slowed(self, factor: float) -> "ScheduledGains":
        """Return the rules for commands that are older by a factor [-], which makes motions slower."""
        return self if factor == 1.0 else replace(self, command_age=factor * self.age)

    def for_age(self, age: float) -> "ScheduledGains":
        """Return the rules for a team whose efforts rest on measurements of an age [s].

        A ``command_age`` that is given stays.
        """
        given = self.command_age is not None
        return self if given or age <= IDEAL_AGE else replace(self, command_age=age)


GainSet = Annotated[FixedGains | ScheduledGains, TAGGED]
