"""From which rests a cell can be begun anew under a plan's budget."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from coop_drake.typed_data import Bound, Vector



@dataclass(frozen=True)
class Restart:
    """What a team that begins its current cell anew from rest keeps to, and how far it then departs.

    All axes go slowly to the middle of their goal intervals while the object's position rests, see
    ``laws/beginning.py``. A cell can be begun anew from a rest in which every axis is inside its slice by
    more than its departure here, and the object inside the governed region: then every axis stays in its
    slice, and the object in its tube.

    Attributes:
        rate: Largest nominal rate on the way [rad/s or m/s].
        acceleration: Largest nominal acceleration on the way [rad/s^2 or m/s^2].
        rest_rate: Largest true rate of an axis that is taken for resting [rad/s or m/s].
        wait: For how long after the way no cell is left, so that nothing of the way is left in the loops [s].
        departures: Largest departure of every axis in every cell, from the nominal motion on the way, each of
            shape (1 + n,) [rad or m].
    """

    rate: Bound
    acceleration: Bound
    rest_rate: _Exact
    wait: Bound
    departures: tuple[Vector, ...]
