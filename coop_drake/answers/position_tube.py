"""The position's part of a budget: how far the object may depart from its nominal motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from coop_drake.typed_data import Bound, Vector



@dataclass(frozen=True)
class PositionTube:
    """The tube about the nominal motion of the object's origin, the same in every transition of a plan.

    Attributes:
        tracking_stiffness: K_t, with which robots pull the object to its nominal motion [1/s^2].
        tracking_damping: zeta_t, likewise for velocities [1/s].
        speed: Largest speed of p_G [m/s].
        radius: r, largest distance of the object's origin from its nominal position [m].
        rate: Largest departure of its velocity from the nominal one [m/s].
        velocity: Largest speed of the object's origin [m/s].
        rest: Largest distance from the nominal position after both have come to rest [m].
        acceleration: Largest acceleration that a robot commands for the object's origin, times the factor by
            which its masses may be too large: its forces over the true mass [m/s^2].
        ahead: Largest distance e + t e' to which its departures e and e' at a sample would take it within the
            time t for which nobody may know of them, see ``laws/departure.py`` [m].
    """

    tracking_stiffness: Bound
    tracking_damping: Bound
    speed: Bound
    radius: _Exact
    rate: _Exact
    velocity: _Exact
    rest: _Exact
    acceleration: _Exact
    ahead: _Exact
