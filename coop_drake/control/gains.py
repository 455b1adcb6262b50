"""Gain sets: the paper's fixed gains (Table 2) and gains scheduled by cell; and the gains of one transition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


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

    stiffness: float
    damping: float
    governor_gain: float
    smoothing: float
    funnel: Literal["exponential", "smooth"]
    decay_rate: FloatArray
    log_gain: FloatArray
    position_gain: float
    rate_gain: float
    energy_bound: FloatArray
