"""What an exploration left undecided on its last channel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from coop_drake.geometry.minkowski import to_polygon
from coop_drake.geometry.pose import FloatArray
from coop_drake.planning.cell_graph import Cell, Kind
from coop_drake.planning.problem import PlanningProblem
from coop_drake.planning.slices import Slices


@dataclass(frozen=True)
class MixedCell:
    """A set of configurations of which neither freedom nor collision was proved.

    Attributes:
        robots: Robots that take part; the axes are theta and the joints of these robots in the order of q.
        lower: Lower ends of the nominal intervals, shape (1 + m,) [rad, m].
        upper: Upper ends, shape (1 + m,).
        polygon: Positions p_WL outside which nothing is free [m].
        share: The widest of its intervals as a fraction of that axis.
        hinted: Whether its middle configuration is free.
        finest: Whether every interval is below the resolution, so that it will not be halved any more.
    """

    robots: tuple[int, ...]
    lower: FloatArray
    upper: FloatArray
    polygon: Polygon
    share: float
    hinted: bool
    finest: bool


def mixed_cells(
    problem: PlanningProblem, slices: Slices, finest: Sequence[float], channel: Sequence[Cell]
) -> tuple[MixedCell, ...]:
    """Cells of a channel that are not free, the widest first.

    Args:
        problem: The question that was explored.
        slices: The subdivision.
        finest: Resolution of every axis.
        channel: The last channel.
    """
    robots = tuple(sorted({joint.robot for joint in problem.tree.joints}))
    cells = []
    for cell in channel:
        if cell.kind is Kind.FREE:
            continue
        lower, upper = np.array(slices.all[cell.slice].intervals).T.copy()
        share = float(((upper - lower) / np.array(slices.axis_widths)).max())
        done = bool((upper - lower <= np.array(finest)).all())
        polygon = to_polygon(cell.region.section)
        cells.append(MixedCell(robots, lower, upper, polygon, share, cell.kind is Kind.GUIDE, done))
    return tuple(sorted(cells, key=lambda cell: -cell.share))
