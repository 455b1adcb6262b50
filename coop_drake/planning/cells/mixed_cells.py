"""Which cells of a path are not proved free, and how far their slices could still be halved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.answers.mixed_cell import MixedCell
from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.minkowski import to_polygon
from coop_drake.planning.cells.cell_graph import GraphCell, Kind
from coop_drake.planning.cells.slices import Slices


def mixed_cells(
    problem: PlanningProblem, slices: Slices, finest: Sequence[float], path: Sequence[GraphCell]
) -> tuple[MixedCell, ...]:
    """Cells of a path that are not proved free, the widest first.

    ``path``: cells from start to goal that were found last.
    """
    robots = tuple(sorted({joint.robot for joint in problem.tree.joints}))
    cells = []
    for cell in path:
        if cell.kind is Kind.FREE:
            continue
        lower, upper = np.array(slices.all[cell.slice].intervals).T.copy()
        fraction = float(((upper - lower) / np.array(slices.axis_widths)).max())
        done = bool((upper - lower <= np.array(finest)).all())
        polygon = to_polygon(cell.region.section)
        cells.append(MixedCell(robots, lower, upper, polygon, fraction, done))
    return tuple(sorted(cells, key=lambda cell: -cell.width_fraction))
