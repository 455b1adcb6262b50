"""Tables 1 and 2: the cells of our plan and our parameters beside the paper's."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import degrees

import numpy as np

from coop_drake.answers import Plan
from coop_drake.laws import FixedGains
from coop_drake.plant.team import ObjectInertia
from coop_drake.tree.arrays import FloatArray
from paper.comparison import GainFigures
from paper.exhibits import Statement
from paper.stated import CELLS, START, TABLE_2, Parameter
from paper.table_1 import CORRECTED, GOAL_ANGLE

__all__ = ["interval_statements", "parameter_statements", "played_statements"]

_SAME = 1e-9
"""Relative rounding error of a parameter that is written to a model file and read again."""

_PRINTED = 0.5e-3
"""Largest rounding error of the angles that Table 1 prints [rad]."""

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
            "Neighbouring cells overlap in every angle and joint.",
            ("they do" if shared > 0.0 else "they do not",),
            shared > 0.0 and printed_shared > 0.0,
            ("E39", "ET1"),
        ),
        Statement(
            f"Their smallest overlap is {printed_shared:.3f} rad.",
            (f"{shared:.3f} rad",),
            abs(shared - printed_shared) < _PRINTED,
            ("R1", "R9"),
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
    """Compare the joints: in how many cells the arms must be bent, and the intervals that they end in."""
    folded = " and ".join(f"q{name} in {_interval(paper, axis)}" for axis, name in ((1, "₁₁"), (2, "₂₁")))
    return (
        Statement(
            f"In {_bent(*paper)} of {len(paper[0])} cells an arm must be bent, in the others both may be "
            "straight.",
            (f"in {_bent(*ours)} of {len(ours[0])}",),
            _bent(*ours) == _bent(*paper) and len(ours[0]) == len(paper[0]),
            ("R1", "R2", "R9"),
        ),
        Statement(
            f"It ends with both arms folded, {folded}.",
            (f"q₁₁ in {_interval(ours, 1)} and q₂₁ in {_interval(ours, 2)}",),
            _same(ours, paper, 1) and _same(ours, paper, 2),
            ("R1", "R4", "R9"),
        ),
    )


def _overlap(lower: FloatArray, upper: FloatArray) -> float:
    """Return the smallest overlap of neighbouring intervals on any axis; negative if two do not overlap."""
    return float((np.minimum(upper[1:], upper[:-1]) - np.maximum(lower[1:], lower[:-1])).min())


def _bent(lower: FloatArray, upper: FloatArray) -> int:
    """Return the number of cells whose intervals exclude zero for some joint."""
    return int(np.any((lower[:, 1:] > 0.0) | (upper[:, 1:] < 0.0), axis=1).sum())


def _interval(bounds: Bounds, axis: int) -> str:
    return f"[{bounds[0][-1, axis]:.3f}, {bounds[1][-1, axis]:.3f}]"


def _same(ours: Bounds, paper: Bounds, axis: int) -> bool:
    """Return whether the last intervals of an axis are the same, as far as the paper prints them."""
    return all(
        abs(own[-1, axis] - printed[-1, axis]) < _PRINTED for own, printed in zip(ours, paper, strict=True)
    )


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
        copied=True,
    )
