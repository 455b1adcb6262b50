"""Check that every state lay in its cell: the position in its polygon, the axes in their intervals."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.between import Between
from coop_drake.verification.runs.rows import Rows

ROUNDING = 1e-8
"""Distances that are computed twice may differ by so much [m, rad]."""


def check_cells(rows: Rows, between: Between) -> tuple[Check, Check]:
    """Check position and axes against the current cell in every row and between rows.

    A row at which a cell is entered must lie in both its cells. Between two rows the position is as near to
    the chord as ``Between`` says, and so is every axis.
    """
    log, plan = rows.log, rows.plan
    clearance, slices = np.empty(len(log.times)), np.empty(len(log.times))
    least, least_slice = np.inf, np.inf
    for members, k in reversed(rows.motions):  # the row of an entry is stated for the cell that is left
        cell, first = plan.cells[k], int(members[0])
        position, axes = rows.z[members, :2], rows.z[members, 2:]
        deviations = between.deviations[members[:-1]]
        inside = signed_distances(cell.tidied, position)
        chords = shapely.linestrings(np.stack((position[:-1], position[1:]), axis=1))
        left = shapely.distance(chords, cell.tidied.boundary) - np.hypot(deviations[:, 0], deviations[:, 1])
        margins = np.minimum(axes - cell.lower, cell.upper - axes)
        inner = np.minimum(margins[1:], margins[:-1]) - deviations[:, 2:]
        for name, at_rows, since, where in (
            ("object_pose", inside, left, f"cell {k}"),
            ("angle, joints", margins, inner, f"the intervals of cell {k}"),
        ):
            rows.require(at_rows > 0.0, name, f"lies outside {where}", first=first)
            text = f"may have left {where} since the row before: the log is too sparse"
            rows.require(since > 0.0, name, text, first=first + 1)
        clearance[members], slices[members] = inside, margins.min(axis=1)
        least = min(least, float(left.min(initial=np.inf)))
        least_slice = min(least_slice, float(inner.min(initial=np.inf)))
    rows.require_same("cell_clearance", clearance, ROUNDING)
    rows.require_same("slice_margin", slices, ROUNDING)
    place, interval = (
        "the position lay in its cell, between rows, too",
        "every axis lay in its cell's interval",
    )
    count = 2 * len(log.times)
    return (
        Check(place, count, least, "m, least", ("cell_clearance",)),
        Check(
            f"{interval}, between rows, too",
            count * (rows.z.shape[1] - 2),
            least_slice,
            "rad or m, least",
            ("slice_margin",),
        ),
    )


def signed_distances(region: Polygon, points: FloatArray) -> FloatArray:
    """Distances of points (m, 2) to a region's boundary, negative outside, shape (m,) [m]."""
    away = shapely.distance(shapely.points(points), region.boundary)
    signed: FloatArray = np.where(shapely.contains_xy(region, points[:, 0], points[:, 1]), away, -away)
    return signed
