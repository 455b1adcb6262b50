"""Which over-cells may still be reached from the start: the components that a proof keeps apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.graph import Kind
from coop_drake.planning.cells.slices import holds, share_facet
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.search_states import Leaf

_SLACK = 1e-6
"""Slack of the quick test for neighbours that goes before the exact one [rad, m]."""


@dataclass(frozen=True, eq=False)
class Components:
    """Over-cells, divided by whether a sequence of meeting over-cells joins them to the start.

    Attributes:
        reached: Slice and region of every over-cell that is joined to the start.
        others: Slice and region of every over-cell that is not.
    """

    reached: tuple[tuple[Leaf, Region], ...]
    others: tuple[tuple[Leaf, Region], ...]


def components_from_start(leaves: Sequence[Leaf], start: FloatArray, circular: Sequence[bool]) -> Components:
    """Divide the over-cells of a subdivision into those that are joined to the start and the others.

    The start is (x, y, theta, q...) with the joints that the subdivision has, shape (2 + axes,) [m, rad];
    ``circular`` says which of (theta, q...) are circles.
    """
    cells = [(leaf, region) for leaf in leaves for region in leaf.regions(Kind.MIXED)]
    angles = [float(angle) for angle in start[2:]]
    front = [
        cell
        for cell, (leaf, region) in enumerate(cells)
        if holds(leaf.intervals, angles, circular) and region.holds(start[:2])
    ]
    unseen = np.ones(len(cells), dtype=bool)
    unseen[front] = False
    bounds = np.array([leaf.intervals for leaf, _ in cells]).reshape(len(cells), len(angles), 2)
    middle, half = bounds.mean(axis=2), 0.5 * np.ptp(bounds, axis=2)
    while front:
        cell = front.pop()
        leaf, region = cells[cell]
        away = np.abs(middle - middle[cell])
        away = np.where(circular, np.minimum(away, np.abs(2.0 * np.pi - away)), away)
        near = unseen & (away <= half + half[cell] + _SLACK).all(axis=1)
        for other in np.flatnonzero(near).tolist():
            beside, beyond = cells[other]
            adjoin = beside is not leaf and share_facet(leaf.intervals, beside.intervals, circular)
            if adjoin and region.meets(beyond):
                unseen[other] = False
                front.append(other)
    return Components(
        tuple(cell for cell, apart in zip(cells, unseen, strict=True) if not apart),
        tuple(cell for cell, apart in zip(cells, unseen, strict=True) if apart),
    )
