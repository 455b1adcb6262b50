"""The cells that an undecided search proved neither free nor blocked, and which key to change."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from coop_drake.answers.mixed_cell import MixedCell

SHOWN = 3
"""Cells that are described, the widest first [-]."""


def mixed_sentences(cells: Sequence[MixedCell]) -> list[str]:
    """Where mixed cells, the widest first, remained, and which keys of ``planner`` to change."""
    sentences = [
        f"{len(cells)} cells on the last channel were proved neither free nor blocked; "
        f"the widest spans {100.0 * cells[0].width_fraction:.2g} % of an axis."
    ]
    for cell in cells[:SHOWN]:
        x_min, y_min, x_max, y_max = cell.polygon.bounds
        sentences.append(
            f"One is x {x_min:.3f} to {x_max:.3f} m, y {y_min:.3f} to {y_max:.3f} m, {_intervals(cell)}."
        )
    if all(cell.finest for cell in cells):
        sentences.append(
            "They are below the resolution: lower planner.angle_resolution and planner.length_resolution."
        )
    else:
        sentences.append("They could be halved further: raise planner.max_slices.")
    return sentences


def _intervals(cell: MixedCell) -> str:
    robots = f" of robots {', '.join(map(str, cell.robots))}" if cell.robots else ""
    theta, *joints = (f"{low:.4f} to {high:.4f}" for low, high in zip(cell.lower, cell.upper, strict=True))
    return f"theta {theta} rad" + (f", joints{robots} {', '.join(joints)}" if joints else "")


def mixed_facts(cell: MixedCell) -> dict[str, Any]:
    """A mixed cell in plain numbers."""
    return {
        "robots": list(cell.robots),
        "bounds": [float(value) for value in cell.polygon.bounds],
        "lower": [float(value) for value in cell.lower],
        "upper": [float(value) for value in cell.upper],
        "share_of_axis": cell.width_fraction,
        "below_resolution": cell.finest,
    }
