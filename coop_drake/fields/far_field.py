"""What is far from a point: the power series of the leaf of the quadtree that holds the point."""

from __future__ import annotations

from coop_drake.compiled import compiled
from coop_drake.fields.flat_map import BOXES, LEAF_SQUARE, LOCAL, ORDER, ROOT, FlatMap, integer, row
from coop_drake.fields.near_field import Sums


@compiled(reassociate=True)
def leaf_at(m: FlatMap, x: float, y: float) -> int:
    """Index of the leaf that holds a point."""
    root = row(m, ROOT, 0, 3)
    cx, cy, half = m[root], m[root + 1], m[root + 2]
    box = integer(m, BOXES, 0, 1, 0)
    while box >= 0:
        half *= 0.5
        box = integer(m, BOXES, box + (1 if x > cx else 0) + (2 if y > cy else 0), 1, 0)
        cx += half if x > cx else -half
        cy += half if y > cy else -half
    return -1 - box


@compiled(reassociate=True)
def far_field(m: FlatMap, leaf: int, x: float, y: float) -> Sums:
    """The series of a leaf at a point: both sums and their derivatives, by Horner's rule."""
    square, series = row(m, LEAF_SQUARE, leaf, 3), row(m, LOCAL, leaf, 4 * ORDER)
    inverse = 1.0 / m[square + 2]
    zx, zy = (x - m[square]) * inverse, (y - m[square + 1]) * inverse
    ur, ui, vr, vi = 0.0, 0.0, 0.0, 0.0
    dur, dui, dvr, dvi = 0.0, 0.0, 0.0, 0.0
    for k in range(ORDER - 1, -1, -1):
        c = series + 4 * k
        dur, dui = dur * zx - dui * zy + ur, dur * zy + dui * zx + ui
        dvr, dvi = dvr * zx - dvi * zy + vr, dvr * zy + dvi * zx + vi
        ur, ui = ur * zx - ui * zy + m[c], ur * zy + ui * zx + m[c + 1]
        vr, vi = vr * zx - vi * zy + m[c + 2], vr * zy + vi * zx + m[c + 3]
    return ui, vi, dui * inverse, dur * inverse, dvi * inverse, dvr * inverse, 0.0, 0.0
