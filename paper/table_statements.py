"""Tables 1 and 2: the cells of our plan and our parameters beside the paper's."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import degrees

import numpy as np

from coop_drake.answers import Plan
from coop_drake.laws import FixedGains
from coop_drake.plant.team import ObjectInertia
from coop_drake.tree.pose import FloatArray
from paper.comparison import GainFigures
from paper.exhibits import Statement
from paper.stated import CELLS, START, TABLE_2, Parameter
from paper.table_1 import CORRECTED, GOAL_ANGLE

__all__ = ["interval_statements", "parameter_statements", "played_statements"]

_SAME = 1e-9
"""Relative rounding error of a parameter that is written to a model file and read again."""


Bounds = tuple[FloatArray, FloatArray]


def interval_statements(plan: Plan) -> tuple[Statement, ...]:
    """Compare a plan's cells with Table 1.

    Args:
        plan: Of a team of two robots with a joint each.
    """
    ours = np.array([cell.lower for cell in plan.cells]), np.array([cell.upper for cell in plan.cells])
    paper = CORRECTED[:, 0::2], CORRECTED[:, 1::2]
    turn, printed_turn = plan.goal_pose[2] - plan.start[2], GOAL_ANGLE - START[2]
    shared, printed_shared = _overlap(*ours), _overlap(*paper)
    return (
        Statement(
            f"The plan has {CELLS} cells.", (f"{len(plan.cells)}",), len(plan.cells) == CELLS, ("R1", "R9")
        ),
        Statement(
            f"Neighbouring cells overlap in every angle and joint, by {printed_shared:.3f} rad at least.",
            (f"by {shared:.3f} rad at least",),
            shared > 0.0 and printed_shared > 0.0,
            ("E39", "ET1"),
        ),
        Statement(
            f"The object turns from {START[2]} rad to {GOAL_ANGLE} rad, by {degrees(printed_turn):+.0f}°.",
            (f"{plan.start[2]:.3f} rad to {plan.goal_pose[2]:.3f} rad, by {degrees(turn):+.0f}°",),
            bool(abs(turn - printed_turn) < _SAME),
            ("R8", "R9"),
        ),
        *_posture_statements(ours, paper),
    )


def _posture_statements(ours: Bounds, paper: Bounds) -> tuple[Statement, ...]:
    """Compare the joints: where the arms must be bent, where they may be straight, and how they end."""
    bent, straight = _bent(*ours), _straight(*ours)
    folded = " and ".join(f"q{name} in {_interval(paper, axis)}" for axis, name in ((1, "₁₁"), (2, "₂₁")))
    return (
        Statement(
            f"Somewhere the team must bend its arms: so in {_bent(*paper)} cells of {len(paper[0])}.",
            (f"in {bent} of {len(ours[0])}",),
            bent > 0 and _bent(*paper) > 0,
            ("R1", "R2"),
        ),
        Statement(
            f"Somewhere it need not: {_straight(*paper)} cells allow both arms to be straight.",
            (f"{straight} of {len(ours[0])}",),
            straight > 0 and _straight(*paper) > 0,
            ("R1", "R2", "R9"),
        ),
        Statement(
            f"It ends with both arms folded, {folded}.",
            (f"q₁₁ in {_interval(ours, 1)} and q₂₁ in {_interval(ours, 2)}",),
            _meet(ours, paper, 1) and _meet(ours, paper, 2),
            ("R1", "R4", "R9"),
        ),
    )


def _overlap(lower: FloatArray, upper: FloatArray) -> float:
    """Return the smallest overlap of neighbouring intervals on any axis; negative if two do not overlap."""
    return float((np.minimum(upper[1:], upper[:-1]) - np.maximum(lower[1:], lower[:-1])).min())


def _bent(lower: FloatArray, upper: FloatArray) -> int:
    """Return the number of cells whose intervals exclude zero for some joint."""
    return int(np.any((lower[:, 1:] > 0.0) | (upper[:, 1:] < 0.0), axis=1).sum())


def _straight(lower: FloatArray, upper: FloatArray) -> int:
    return len(lower) - _bent(lower, upper)


def _interval(bounds: Bounds, axis: int) -> str:
    return f"[{bounds[0][-1, axis]:.3f}, {bounds[1][-1, axis]:.3f}]"


def _meet(ours: Bounds, paper: Bounds, axis: int) -> bool:
    """Return whether the last intervals of an axis have a value in common."""
    return bool(ours[0][-1, axis] <= paper[1][-1, axis] and paper[0][-1, axis] <= ours[1][-1, axis])


def played_statements(played: Sequence[GainFigures]) -> tuple[Statement, ...]:
    """State the results of the paper's own cells in closed loop.

    Args:
        played: What every gain set made of them.
    """
    arrived = ("arrives, nothing violated" if not gains.violation else gains.violation for gains in played)
    return (
        Statement(
            f"The controllers carry the team through all {CELLS} cells, every specification kept.",
            tuple(arrived),
            not any(gains.violation for gains in played),
            ("ET1", "E17a", "E17b", "E18", "E20", "E35", "R7", "R10"),
        ),
        *_figures(played),
    )


def _figures(played: Sequence[GainFigures]) -> Iterator[Statement]:
    for label, name, form in GainFigures.ROWS:
        texts = tuple(form.format(getattr(gains, name)) for gains in played)
        yield Statement(label, texts, None, ("R3", "R10") if name == "peak_force" else ("R10",))


def parameter_statements(gain_set: FixedGains, inertia: ObjectInertia) -> tuple[Statement, ...]:
    """Compare our parameters with Table 2.

    Args:
        gain_set: What the scenario has under the name of Table 2.
        inertia: The object's.
    """
    return tuple(_parameter(row, _value(row, gain_set, inertia)) for row in TABLE_2)


def _value(row: Parameter, gain_set: FixedGains, inertia: ObjectInertia) -> float:
    if row.gain:
        return float(getattr(gain_set, row.gain))
    return inertia.mass if row.symbol == "M_L" else inertia.inertia_about_com


def _parameter(row: Parameter, value: float) -> Statement:
    unit = f" {row.unit}" if row.unit else ""
    because = ("R6",) if row.gain.startswith(("joint", "position", "rate")) else ()
    return Statement(
        f"{row.symbol} = {row.value:g}{unit}, {row.meaning}",
        (f"{value:.10g}{unit}",),
        abs(value - row.value) <= _SAME * abs(row.value),
        because,
    )
