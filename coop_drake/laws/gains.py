"""Gain sets: fixed gains (the paper's Table 2) or scheduled by cell; and the gains of one transition."""

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from coop_drake.typed_data import EXACT, DataError, Limits, NotNegative, Positive, Vector, check_fields

FloatArray = NDArray[np.float64]
FunnelShape = Literal["exponential", "smooth"]

EnergyFactor = Annotated[float, Limits(at_least=1.0)]
"""A multiple of the energy at rest; below 1 no transition could begin [-]."""

Gain = Annotated[Positive, EXACT]
"""A gain of one transition, of any size: it may be a product of numbers of a gain set."""

AxisGains = Annotated[Vector, Limits(above=0.0)]
"""Gains of one transition, one for each of the axes (theta, q...), shape (1 + n,)."""


@dataclass(frozen=True)
class TransitionGains:
    """Gains of one transition; per-axis arrays are ordered (theta, q...).

    Attributes:
        stiffness: K of (14) [1/s^2].
        damping: zeta of (14) [1/s].
        governor_gain: K_G of (14) [-].
        smoothing: c of the smoothed square root sqrt(x + c^2) - c; 0 gives the printed root [m].
        funnel: ``exponential`` as printed in (17), or ``smooth`` (C1 at the switch).
        decay_rate: lambda of (17), (39), shape (1 + n,) [1/s].
        log_gain: kappa, gain of the log term of (18), shape (1 + n,) [rad^2/s^2 or m^2/s^2].
        position_gain: k1 of (18)-(20) [1/s].
        rate_gain: k2 of (18) [1/s].
        energy_bound: Largest PPC energy V accepted when this transition is entered, shape (1 + n,).
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
    energy_bound: AxisGains

    @property
    def governor_row(self) -> FloatArray:
        """K, zeta, K_G and c, as compiled code reads them, shape (4,)."""
        return np.array([self.stiffness, self.damping, self.governor_gain, self.smoothing])

    def select(self, axes: NDArray[np.intp]) -> "TransitionGains":
        """Return the same gains for some axes only, for instance those that one robot controls."""
        return replace(
            self,
            decay_rate=self.decay_rate[axes],
            log_gain=self.log_gain[axes],
            energy_bound=self.energy_bound[axes],
        )


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
        funnel: ``exponential`` or ``smooth``.
        angle_decay_rate: lambda of the object's angle [1/s].
        joint_decay_rate: lambda of every joint [1/s].
        log_gain: kappa [rad^2/s^2 or m^2/s^2].
        position_gain: k1 [1/s].
        rate_gain: k2 [1/s].
        energy_factor: A transition is entered below this multiple of the energy at rest ...
        energy_allowance: ... plus this multiple of kappa.
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
    energy_factor: EnergyFactor = 1.2
    energy_allowance: Positive = 0.5

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class ScheduledGains:
    """Rules by which gains follow the cell: K grows where it is narrow, lambda where funnels shrink little.

    Attributes:
        wall_stiffness: K times the path's clearance b, K = clamp(wall_stiffness / b) [m/s^2].
        min_stiffness: Smallest K [1/s^2].
        max_stiffness: Largest K [1/s^2].
        damping_factor: zeta over sqrt(K) [-].
        governor_factor: K_G over sqrt(K) [s].
        smoothing: c of the governor's root [m].
        funnel: ``smooth`` or ``exponential``.
        funnel_acceleration: Wall acceleration aimed at, lambda = clamp(sqrt(. / shrink)) [rad/s^2 or m/s^2].
        min_decay_rate: Smallest lambda [1/s].
        max_decay_rate: Largest lambda [1/s].
        max_log_gain: Largest kappa [rad^2/s^2 or m^2/s^2].
        log_acceleration: Largest kappa |a s| when a transition is entered at rest [rad/s^2 or m/s^2].
        position_gain: k1 [1/s].
        rate_gain: k2 [1/s].
        energy_factor: A transition is entered below this multiple of the energy at rest ...
        energy_allowance: ... plus this multiple of kappa.
    """

    wall_stiffness: Positive = 20.0
    min_stiffness: Positive = 50.0
    max_stiffness: Positive = 400.0
    damping_factor: Positive = 1.0
    governor_factor: Positive = 0.8
    smoothing: NotNegative = 0.001
    funnel: FunnelShape = "smooth"
    funnel_acceleration: Positive = 20.0
    min_decay_rate: Positive = 2.0
    max_decay_rate: Positive = 8.0
    max_log_gain: Positive = 0.1
    log_acceleration: Positive = 20.0
    position_gain: Positive = 1.0
    rate_gain: Positive = 8.0
    energy_factor: EnergyFactor = 1.2
    energy_allowance: Positive = 0.5

    def __post_init__(self) -> None:
        check_fields(self)
        for low, high in (("min_stiffness", "max_stiffness"), ("min_decay_rate", "max_decay_rate")):
            least, largest = getattr(self, low), getattr(self, high)
            if least > largest:
                raise DataError(low, least, f"at most {high}, {largest:g}")


GainSet = FixedGains | ScheduledGains
