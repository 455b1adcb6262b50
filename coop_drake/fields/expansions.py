"""Local expansions: the field of everything far from a box, as one short power series.

A quadtree covers the domain. Every box has a list of the sources near it: panels, rings of corners, corners
from some level down. A source that was near the parent and is far from the box is added to the box's power
series; the others are passed on to its four quarters. A leaf keeps one series for all far sources and a short
list of near ones, so that evaluating a point costs a polynomial and a few panels, however long the boundary
is.

A source is far from a box if its quadrature is exact everywhere in the box and its series converges fast
enough.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.flat_map import (
    CORNER_INDEX,
    CORNERS,
    EDGES,
    INSIDE,
    LEVELS,
    ON_BOUNDARY,
    OUTSIDE,
    REFINED_NODES,
    FlatMap,
    MapArrays,
    flatten,
    integer,
    row,
    rows_of,
)
from coop_drake.fields.sources import FAR, gather, seen_from
from coop_drake.fields.walls import is_inside
from coop_drake.tree.pose import FloatArray, IntArray

_REACH = 2.8
"""Distance of a far source per radius of the box: 2.8^-28 of the series is left out, 3e-13 [-]."""
_REFINED = 1.45
"""|zeta| from which the refined nodes of a panel are enough to integrate over it [-]."""
_TAIL = 2.0
"""Distance from the vertex, per length of the legs, from which a corner is its compressed density [-]."""
_MANY = 5
"""Near panels that are shorter than the box, above which it is divided."""
_CORNER = 2
"""Cost of a near corner, in near panels."""
_DEPTH = 50
"""Divisions of a box at most: then it is as small as rounding."""
_BOXES = 40_000
"""Boxes of one size at most, which bounds the memory of a map."""


class _Boxes(NamedTuple):
    """Boxes of one size.

    Attributes:
        square: Centre and half diagonal, shape (n, 3).
        state: `ON_BOUNDARY`, `INSIDE` or `OUTSIDE`, shape (n,).
        series: Power series of what is far, shape (n, ORDER, 4).
        near_start: First entry of each in ``near``, and the end, shape (n + 1,).
        near: Rows as in `MapArrays`.
    """

    square: FloatArray
    state: IntArray
    series: FloatArray
    near_start: IntArray
    near: IntArray

    def chosen(self, which: IntArray) -> _Boxes:
        """The boxes of the given indices."""
        count = np.diff(self.near_start)[which]
        start = np.concatenate(([0], np.cumsum(count)))
        rows = np.arange(start[-1]) + np.repeat(self.near_start[which] - start[:-1], count)
        return _Boxes(self.square[which], self.state[which], self.series[which], start, self.near[rows])

    def quarters(self) -> _Boxes:
        """The four quarters of each box, with the sources that were near the whole box."""
        series = np.repeat(self.series, 4, axis=0)
        signs = np.array([(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)])
        _shift(series, signs / np.sqrt(8.0))
        square = np.repeat(self.square, 4, axis=0)
        square[:, :2] += np.tile(signs, (len(self.square), 1)) * square[:, 2:] / np.sqrt(8.0)
        square[:, 2] *= 0.5
        return self.chosen(np.repeat(np.arange(len(self.square)), 4))._replace(square=square, series=series)


def grown(m: MapArrays, *, opened: bool) -> MapArrays:
    """Divide the leaves of a map, valid if large, until few sources are near any of them.

    ``opened``: whether corners may be opened into their rings, and panels have their refined densities.
    """
    flat, scratch = flatten(m, np.zeros(2), 0.0), np.empty((6, _most_nodes(m)))
    todo = np.empty((LEVELS * (2 * max(int(m.corner_index[:, 1].max()), 1) + 1) + 1, 3), dtype=np.int64)
    boxes = m.boxes.copy()
    box = np.flatnonzero(boxes < 0)
    box = box[np.argsort(-boxes[box])]
    current = _Boxes(m.leaf_square, m.leaf_state, m.local, m.near_start, m.near)
    finished: list[_Boxes] = []
    leaves = 0
    for depth in range(_DEPTH):
        start, near, gain = _sort_out(flat, opened, *current, scratch, todo)
        current = current._replace(near_start=start, near=near)
        # Before corners are opened, the boxes serve points of the boundary alone.
        served = current.state != OUTSIDE if opened else current.state == ON_BOUNDARY
        split = (gain > _MANY) & served & (depth + 1 < _DEPTH)
        split &= 4 * np.count_nonzero(split) <= _BOXES
        leaf = np.flatnonzero(~split)
        finished.append(current.chosen(leaf))
        boxes[box[leaf]] = -1 - leaves - np.arange(len(leaf))
        leaves += len(leaf)
        if not split.any():
            break
        current = current.chosen(np.flatnonzero(split)).quarters()
        new = len(boxes) + np.arange(len(current.state))
        boxes[box[split]] = new[::4]
        boxes, box = np.concatenate((boxes, new)), new
    counts = np.concatenate([np.diff(part.near_start) for part in finished])
    return m._replace(
        boxes=boxes,
        leaf_square=np.concatenate([part.square for part in finished]),
        leaf_state=np.concatenate([part.state for part in finished]),
        local=np.concatenate([part.series for part in finished]),
        near_start=np.concatenate(([0], np.cumsum(counts))),
        near=np.concatenate([part.near for part in finished]),
    )


def _most_nodes(m: MapArrays) -> int:
    """Most nodes that one source has."""
    first = m.corner_index[:, 0]
    per_panel = (m.sources.shape[1] - first[-1]) // max(len(m.panels), 1)
    blocks = np.concatenate((np.diff(first), 2 * m.corner_index[:, 2]))
    return int(max(REFINED_NODES, per_panel, blocks.max()))


@compiled(reassociate=True)
def _sort_out(
    m: FlatMap, opened: bool, square: FloatArray, state: IntArray, series: FloatArray,
    start: IntArray, near: IntArray, nodes: FloatArray, todo: IntArray,
) -> tuple[IntArray, IntArray, IntArray]:  # fmt: skip
    """Add to each box's series what is far from it, and find its state.

    Args:
        m: The map.
        opened: As for `grown`.
        square: The boxes, as the next four: see `_Boxes`.
        state: Is changed.
        series: Are changed.
        start: First candidate of each box.
        near: Candidates: what was near the box that was divided.
        nodes: Scratch for the nodes of one source, shape (6, .).
        todo: Scratch for sources, shape (., 3).

    Returns:
        Where the rows start that stay near each box, these rows, and how many of them a division may remove.
    """
    kept, first = np.empty((2 * len(near) + 64, 3), dtype=np.int64), np.zeros(len(square) + 1, dtype=np.int64)
    gain = np.zeros(len(square), dtype=np.int64)
    end = 0
    for box in range(len(square)):
        x, y, radius = square[box, 0], square[box, 1], square[box, 2]
        nearest = np.inf
        for candidate in range(start[box], start[box + 1]):
            for i in range(3):
                todo[0, i] = near[candidate, i]
            waiting = 1
            while waiting > 0:
                waiting -= 1
                k, place, level = todo[waiting, 0], todo[waiting, 1], todo[waiting, 2]
                seen = seen_from(m, k, place, level, x, y)
                if _is_far(place, opened, seen, radius):
                    count = gather(m, k, place, level, opened, seen, x, y, radius, nodes)
                    _expand(nodes, count, radius, series, box)
                elif opened and place < 0 and seen[2] >= radius and level + 1 < LEVELS:
                    # The panels of the corner's ring, and the corner within, are candidates in its place.
                    panels = 2 * integer(m, CORNER_INDEX, k, 7, 1)
                    for j in range(panels + 1):
                        todo[waiting + j, 0] = k
                        todo[waiting + j, 1] = j if j < panels else -1
                        todo[waiting + j, 2] = level if j < panels else level + 1
                    waiting += panels + 1
                else:
                    if end == len(kept):
                        grown_list = np.empty((2 * end, 3), dtype=np.int64)
                        for i in range(end):
                            for j in range(3):
                                grown_list[i, j] = kept[i, j]
                        kept = grown_list
                    kept[end, 0], kept[end, 1], kept[end, 2] = k, place, level
                    end += 1
                    nearest = min(nearest, seen[0])
        gain[box] = _gain(m, kept, first[box], end, x, y, radius)
        if state[box] == ON_BOUNDARY and nearest > radius:
            walls = rows_of(m, EDGES)
            state[box] = INSIDE if is_inside(m, row(m, EDGES, 0, 4), walls, x, y) else OUTSIDE
        if state[box] == OUTSIDE:  # no point is ever looked for there
            end, gain[box] = first[box], 0
        first[box + 1] = end
    return first, kept[:end], gain


@compiled(reassociate=True)
def _gain(m: FlatMap, near: IntArray, first: int, last: int, x: float, y: float, radius: float) -> int:
    """How many of the sources near a box a division may remove: those that are shorter than the box.

    What belongs to a vertex in the box does not count: divisions would find the same again.
    """
    own, nearest, gain = -1, 1.5 * radius, 0
    for item in range(first, last):
        k = near[item, 0]
        if k >= 0:
            corner = row(m, CORNERS, k, 15)
            distance = np.sqrt((m[corner] - x) ** 2 + (m[corner + 1] - y) ** 2)
            if distance < nearest:
                own, nearest = k, distance
    for item in range(first, last):
        k, place = near[item, 0], near[item, 1]
        if (k != own or k < 0) and seen_from(m, k, place, near[item, 2], x, y)[2] < radius:
            gain += 1 if place >= 0 else _CORNER
    return gain


@compiled(reassociate=True)
def _is_far(place: int, opened: bool, seen: tuple[float, float, float], radius: float) -> bool:
    """Whether a source, ``seen`` from the centre of a box, is far from all of the box."""
    distance, middle, size = seen
    if place < 0:
        factor = _TAIL
    elif opened:
        factor = _REFINED
    else:
        factor = FAR
    return distance >= _REACH * radius and middle - radius >= factor * size


@compiled(reassociate=True)
def _expand(nodes: FloatArray, count: int, radius: float, series: FloatArray, box: int) -> None:
    """Add nodes to the series of a box, in units of its radius: real and imaginary parts for u, then for v.

    A node at t adds mu dt / t^(k + 1) to the coefficient of degree k, t seen from the box's centre.
    """
    for j in range(count):
        inverse = 1.0 / (nodes[0, j] * nodes[0, j] + nodes[1, j] * nodes[1, j])
        re, im = nodes[0, j] * inverse, -nodes[1, j] * inverse
        dx, dy = nodes[2, j], nodes[3, j]
        nodes[2, j], nodes[3, j] = dx * re - dy * im, dx * im + dy * re
        nodes[0, j], nodes[1, j] = radius * re, radius * im
    for degree in range(series.shape[1]):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for j in range(count):
            re, im, u, v = nodes[2, j], nodes[3, j], nodes[4, j], nodes[5, j]
            a += u * re
            b += u * im
            c += v * re
            d += v * im
            nodes[2, j], nodes[3, j] = (
                re * nodes[0, j] - im * nodes[1, j],
                re * nodes[1, j] + im * nodes[0, j],
            )
        series[box, degree, 0] += a
        series[box, degree, 1] += b
        series[box, degree, 2] += c
        series[box, degree, 3] += d


@compiled(reassociate=True)
def _shift(series: FloatArray, shifts: FloatArray) -> None:
    """Shift series, four for each box, to its quarters, whose centres are ``shifts`` (4, 2) radii away."""
    n = series.shape[1]
    for box in range(len(series)):
        c, sx, sy = series[box], shifts[box % 4, 0], shifts[box % 4, 1]
        for k in range(n - 1):
            for j in range(n - 2, k - 1, -1):
                u, ui, v, vi = c[j + 1, 0], c[j + 1, 1], c[j + 1, 2], c[j + 1, 3]
                c[j, 0] += sx * u - sy * ui
                c[j, 1] += sx * ui + sy * u
                c[j, 2] += sx * v - sy * vi
                c[j, 3] += sx * vi + sy * v
        scale = 1.0
        for k in range(n):
            for i in range(4):
                c[k, i] *= scale
            scale *= 0.5
