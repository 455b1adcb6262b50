"""The levels above which a measured departure from the nominal motion is an alarm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from coop_drake.typed_data import Bound, Vector



@dataclass(frozen=True)
class Alarms:
    """The levels that all transitions of a plan with a budget have in common, see ``laws/departure.py``.

    Those of angles and joints stand in every transition's ``tolerance``.

    Attributes:
        position: Of the object's measured position, the length of the vector [m].
        velocity: Of its measured velocity, likewise [m/s].
        ahead: Of where both together take it until a report is used that knows of it, likewise [m].
        axis_reserve: What must be left of the distance of a nominal axis (theta, q...) to its funnel's bounds
            beside its level, shape (1 + n,), empty where the budget has no axes [rad or m].
        grasp: Of the distance of a grasp from where the measured pose of the base has it; null where the
            budget has no such error [m].
        turn: Of the measured angle of a base, likewise [rad].
    """

    position: Bound
    velocity: Bound
    ahead: Bound
    axis_reserve: Vector
    grasp: Bound | None = None
    turn: Bound | None = None
