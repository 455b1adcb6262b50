"""Numbers that the paper states about its example: start, goal, number of cells, Table 2, Figure 3."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

__all__ = ["CELLS", "FIGURE_3_SLICES", "GOAL", "START", "TABLE_2", "Parameter"]

START = (0.9, 2.0, 1.57, 0.0, 0.0)
"""(x, y, theta, q_11, q_21) at the start [m, rad]."""

GOAL = (5.0, 8.0, 4.663)
"""(x, y, theta) at the goal [m, rad]."""

CELLS = 30

FIGURE_3_SLICES = (
    ((0.0, 0.0), (-1.0, 1.0)),
    ((0.0, 0.0), (-0.2, 0.2)),
    ((-0.5 * pi, 0.5 * pi), (-0.2, 0.2)),
    ((-0.2, 0.2), (-0.2, 0.2)),
)
"""Intervals of theta and q for panels b and f, c and g, d and h, e and i of Figure 3, about 0 [rad]."""


@dataclass(frozen=True)
class Parameter:
    """A row of Table 2.

    Attributes:
        symbol: As printed.
        meaning: In words.
        value: As printed.
        unit: Empty where the paper gives none.
        gain: Name of the gain among ``FixedGains``; empty for what belongs to the object.
    """

    symbol: str
    meaning: str
    value: float
    unit: str
    gain: str = ""


TABLE_2 = (
    Parameter("M_L", "mass of the object", 1.0, "kg"),
    Parameter("I_L", "moment of inertia of the object", 1.0, "kg m²"),
    Parameter("K_p", "stiffness towards the governor", 50.0, "", "stiffness"),
    Parameter("ζ_p", "damping of the position", 5.0, "", "damping"),
    Parameter("K_p,G", "gain of the governor", 5.0, "", "governor_gain"),
    Parameter("λ_θ", "decay rate of the angle's funnel", 2.0, "", "angle_decay_rate"),
    Parameter("K_θ,1", "gain on the transformed angle", 1.0, "", "position_gain"),
    Parameter("K_θ,2", "gain on the angular rate", 1.0, "", "rate_gain"),
    Parameter("λ_q", "decay rate of the joints' funnels", 2.0, "", "joint_decay_rate"),
)
