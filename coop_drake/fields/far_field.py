"""What is far from a point: the power series of the leaf of the quadtree that holds it."""

from __future__ import annotations

from coop_drake.compiled import compiled
from coop_drake.fields.layers import MapArrays
from coop_drake.fields.near_field import Sums

__all__ = ["far_field", "leaf_at"]


@compiled(reassociate=True)
def leaf_at(m: MapArrays, x: float, y: float) -> int:
    """Leaf that holds a point."""
    cx, cy, half = m.root[0], m.root[1], m.root[2]
    box = 0
    while m.box_child[box] >= 0:
        half *= 0.5
        box = m.box_child[box] + (1 if x > cx else 0) + (2 if y > cy else 0)
        cx += half if x > cx else -half
        cy += half if y > cy else -half
    return int(m.box_leaf[box])


@compiled(reassociate=True)
def far_field(m: MapArrays, leaf: int, x: float, y: float) -> Sums:
    """Both sums and their derivatives."""
    inverse = 1.0 / m.leaf_square[leaf, 2]
    zx, zy = (x - m.leaf_square[leaf, 0]) * inverse, (y - m.leaf_square[leaf, 1]) * inverse
    series = m.local[leaf]
    n = len(series)
    ur, ui, vr, vi = series[n - 1, 0], series[n - 1, 1], series[n - 1, 2], series[n - 1, 3]
    dur, dui, dvr, dvi = 0.0, 0.0, 0.0, 0.0
    for k in range(n - 2, -1, -1):
        dur, dui = dur * zx - dui * zy + ur, dur * zy + dui * zx + ui
        dvr, dvi = dvr * zx - dvi * zy + vr, dvr * zy + dvi * zx + vi
        ur, ui = ur * zx - ui * zy + series[k, 0], ur * zy + ui * zx + series[k, 1]
        vr, vi = vr * zx - vi * zy + series[k, 2], vr * zy + vi * zx + series[k, 3]
    return ui, vi, dui * inverse, dur * inverse, dvi * inverse, dvr * inverse
