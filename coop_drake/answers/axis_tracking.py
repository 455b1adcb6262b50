"""The axes' part of a budget: with which gains angles and joints are pulled to their nominal motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from coop_drake.typed_data import Bound, Vector



@dataclass(frozen=True)
class AxisTracking:
    """Gains of the pull, the same for all axes and in every transition of a plan.

    Attributes:
        stiffness: K_a [1/s^2].
        damping: zeta_a [1/s].
        rate: Of every axis (theta, q...) a rate that it never exceeds, nominal rate and departure together,
            with which an error of the age of measurements and viscous friction count; empty where no clock is
            wrong and no friction is viscous [rad/s or m/s].
        acceleration: The same of its acceleration [rad/s^2 or m/s^2].
        disturbance: Of the object's origin, then of every axis, the largest acceleration that friction of
            joints causes; empty where there is none [m/s^2, rad/s^2 or m/s^2].
    """

    stiffness: Bound
    damping: Bound
    rate: tuple[Bound, ...] = ()
    acceleration: tuple[Bound, ...] = ()
    disturbance: tuple[_Exact, ...] = ()
