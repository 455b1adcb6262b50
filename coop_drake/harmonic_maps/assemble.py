"""Builds the arrays of a map from a solved density: refined panels, corners at all scales, power series.

The density is interpolated to finer nodes by the integral equation itself (Nystrom interpolation).

A quadtree covers the domain. Every box has a list of the sources near it: panels, rings of corners, corners
from some level down. A source that was near the parent and is far from the box is added to the box's power
series; the others are passed on to its four quarters. A leaf keeps one series for all far sources and a short
list of near ones, so that evaluating a point costs a polynomial and a few panels, however long the boundary
is. A source is far from a box if its quadrature is exact everywhere in the box and its series converges fast
enough.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from coop_drake.harmonic_maps.evaluate import (
    CORNER_INDEX,
    CORNERS,
    EDGES,
    FAR,
    INSIDE,
    LEVELS,
    NEAR,
    NEAR_START,
    ON_BOUNDARY,
    ORDER,
    OUTSIDE,
    REFINED_NODES,
    SOURCES,
    FlatMap,
    MapArrays,
    add_to_series,
    among_walls,
    far_field,
    flatten,
    integer,
    leaf_at,
    length_of,
    panel_ends,
    row,
    seen_from,
    solved_nodes,
)
from coop_drake.harmonic_maps.outline import Outline
from coop_drake.harmonic_maps.panels import (
    Nodes,
    Panels,
    corner_operator,
    leg_panels,
    legendre_transform,
    panel_nodes,
    place_nodes,
)
from coop_drake.harmonic_maps.solve import CLOSE, Density, legendre_moments
from coop_drake.jit import compiled
from coop_drake.tree.arrays import ComplexArray, FloatArray, IntArray

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
_MARGIN = 1.0 + 1e-9
"""Size of the quadtree's square per size of the domain, so that rounding leaves no vertex outside [-]."""


def pack_layers(
    outline: Outline, panels: Panels, angles: FloatArray, density: Density, closeness: float
) -> MapArrays:
    """Everything that evaluates the map of a density; arguments as in `solve_density`."""
    m = _grown(_bare(outline, panels, angles, density), opened=False)
    refined, incoming = _refine(outline, panels, angles, density, closeness, m)
    sources = density.nodes.corner_start
    regular = incoming[refined.corner_start[-1] :].reshape(-1, REFINED_NODES, 2)
    index, grid, breaks, rings, tails = _pack_corners(angles, sources, refined, incoming, closeness)
    index[:, 5] += len(regular)
    values = np.concatenate((regular, rings))
    m = m._replace(
        corner_index=index,
        grid=grid,
        breaks=breaks,
        densities=np.stack((values, legendre_transform(REFINED_NODES) @ values), axis=1),
        tails=tails,
    )
    return _grown(m, opened=True)


def _bare(outline: Outline, panels: Panels, angles: FloatArray, density: Density) -> MapArrays:
    """A map with the solved nodes alone, in a quadtree of one leaf that is near to all of them."""
    v, ends, nodes = outline.vertices, outline.ends, density.nodes
    tangent = (ends - v) / np.abs(ends - v)
    inward = tangent * np.exp(0.5j * angles)
    leg_ends_in, leg_ends_out, panel_ends = _panel_ends(outline, panels)
    collapsed = np.vstack((np.zeros((1, 2)), density.hole_images))[outline.ring]
    index = np.zeros((len(v) + 1, 7), dtype=np.int64)
    index[:, 0] = nodes.corner_start
    low, high = _columns(v).min(axis=0), _columns(v).max(axis=0)
    root = np.array([*(0.5 * (low + high)), 0.5 * _MARGIN * (high - low).max()])
    near = np.zeros((len(panel_ends) + len(v), 3), dtype=np.int64)
    near[: len(panel_ends), 0], near[: len(panel_ends), 1] = -1, np.arange(len(panel_ends))
    near[len(panel_ends) :, 0], near[len(panel_ends) :, 1] = np.arange(len(v)), -1
    return MapArrays(
        edges=_columns(v, ends),
        sources=np.ascontiguousarray(
            np.column_stack((_columns(nodes.position, nodes.element), density.weighted)).T
        ),
        corners=np.column_stack(
            (
                _columns(v, -tangent[outline.preceding], tangent, inward),
                panels.legs,
                leg_ends_in,
                leg_ends_out,
                np.where(outline.ring[:, None] == 0, _columns(np.exp(1j * outline.angle_start)), collapsed),
            )
        ),
        corner_index=index,
        grid=np.empty((0, 2)),
        breaks=np.empty(0),
        densities=np.empty((0, 2, REFINED_NODES, 2)),
        tails=np.empty((0, 2)),
        panels=panel_ends,
        root=root,
        boxes=np.array([-1]),
        leaf_square=np.array([[root[0], root[1], np.sqrt(2.0) * root[2]]]),
        leaf_state=np.array([ON_BOUNDARY]),
        local=np.zeros((1, ORDER, 4)),
        near_start=np.array([0, len(near)]),
        near=near,
    )


def _panel_ends(outline: Outline, panels: Panels) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ends as x y of the incoming legs, of the outgoing legs (corners, 2), and of the panels (panels, 4).

    Neighbours along an edge get the same numbers to the last bit: otherwise a point between them could be
    missed or counted twice.
    """
    v = outline.vertices
    tangent = (outline.ends - v) / np.abs(outline.ends - v)
    start = v[panels.edge] + panels.start * tangent[panels.edge]
    end = v[panels.edge] + panels.end * tangent[panels.edge]
    following = panels.edge[1:] == panels.edge[:-1]
    end[:-1] = np.where(following, start[1:], end[:-1])
    out = v + panels.legs * tangent
    filled, first, count = np.unique(panels.edge, return_index=True, return_counts=True)
    out[filled] = start[first]
    last = out.copy()  # without a panel between them, the edge's two legs end in the same point
    last[filled] = end[first + count - 1]
    return _columns(last[outline.preceding]), _columns(out), _columns(start, end)


def _columns(*arrays: np.ndarray) -> FloatArray:
    """Real and imaginary parts of complex arrays side by side."""
    return np.column_stack([part for z in arrays for part in (z.real, z.imag)])


def _pack_corners(
    angles: FloatArray, sources: IntArray, refined: Nodes, incoming: FloatArray, closeness: float
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Index table, grids, ring breakpoints, ring densities and tails of all corners, as in `MapArrays`."""
    index = np.zeros((len(angles) + 1, 7), dtype=np.int64)
    index[:, 0] = sources
    parts: tuple[list[FloatArray], ...] = ([], [], [], [])
    for k, angle in enumerate(angles):
        leg, ring = leg_panels(float(angle), closeness)
        grid = np.column_stack(panel_nodes(leg, REFINED_NODES))
        block = slice(refined.corner_start[k], refined.corner_start[k + 1])
        index[k, 1:3] = len(ring) - 1, len(grid)
        densities = _descend(float(angle), closeness, incoming[block])
        for part, values in zip(parts, (grid, ring, *densities), strict=True):
            part.append(values)
    index[1:, 3:] = np.cumsum([[len(values) for values in part] for part in parts], axis=1).T
    grids, breaks, rings, tails = (np.concatenate(part) for part in parts)
    return index, grids, breaks, rings, tails


def _descend(angle: float, closeness: float, incoming: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Densities of one corner at every level, from the field that comes in on its two legs (2 n, 2).

    Returns:
        Ring densities in the boundary's direction, shape (LEVELS * 2 legs * m, REFINED_NODES, 2), and
        weight-corrected densities of the legs, shape ((LEVELS + 1) * 2 legs * n, 2).
    """
    operator = corner_operator(angle, REFINED_NODES, closeness)
    back, out = np.split(incoming, 2)
    # Even and odd part of the incoming field at every level: columns (u, v) level by level.
    fields, power = np.stack((0.5 * (out + back), 0.5 * (out - back))), operator.inward
    while fields.shape[-1] < 2 * (LEVELS + 1):
        fields, power = np.concatenate((fields, power @ fields), axis=-1), power @ power
    fields = fields[..., : 2 * (LEVELS + 1)]
    ring = _legs(operator.ring @ fields[..., : 2 * LEVELS]).reshape(LEVELS, 2, -1, REFINED_NODES, 2)
    ring[:, 0] = ring[:, 0, :, ::-1]  # the boundary runs towards the corner on the incoming leg
    tail = _legs(operator.compressed @ fields)
    return ring.reshape(-1, REFINED_NODES, 2), tail.reshape(-1, 2)


def _legs(parts: FloatArray) -> FloatArray:
    """Even and odd parts (2, k, 2 levels) to the incoming and the outgoing leg, (levels, 2, k, 2)."""
    legs = np.stack((parts[0] - parts[1], parts[0] + parts[1]))
    return np.ascontiguousarray(legs.reshape(*parts.shape[:2], -1, 2).transpose(2, 0, 1, 3))


def _refine(
    outline: Outline, panels: Panels, angles: FloatArray, density: Density, closeness: float, m: MapArrays
) -> tuple[Nodes, FloatArray]:
    """Interpolate a density to `REFINED_NODES` nodes on a panel; arguments as in `place_nodes`.

    The map ``m`` has the solved nodes in the leaves of its quadtree, corners not opened.

    Returns:
        The finer nodes, and on them: the density on regular panels, on corner blocks the field that comes in
        from the rest of the boundary, shape (n, 2).
    """
    refined = place_nodes(outline, panels, angles, REFINED_NODES, closeness)
    images = np.vstack((np.zeros((1, 2)), density.hole_images))
    given = np.column_stack((refined.boundary_value.real, refined.boundary_value.imag))
    incoming = 2.0 * (given + images[outline.ring[refined.edge]])
    solved = density.weighted[density.nodes.corner_start[-1] :]
    nodes = max(len(solved) // max(len(panels.edge), 1), 1)
    coefficients = legendre_transform(nodes) @ solved.reshape(len(panels.edge), nodes, 2)
    _subtract(
        flatten(m, np.zeros(2), 0.0), density.nodes.edge, np.ascontiguousarray(coefficients),
        refined.position, refined.edge, refined.corner, incoming,
    )  # fmt: skip
    return refined, incoming


@compiled
def _subtract(
    m: FlatMap, edge: IntArray, coefficients: FloatArray,
    target: ComplexArray, target_edge: IntArray, target_corner: IntArray, out: FloatArray,
) -> None:  # fmt: skip
    """Subtract 2 K density at targets, shape (n,) [m], by the same rules as between the solved nodes.

    ``edge`` is that of each solved node; the density of regular panels comes as Legendre coefficients, shape
    (panels, nodes, 2); corner blocks of targets are -1 on regular panels.
    """
    p = coefficients.shape[1]
    moments = np.empty(max(p, 2))
    for i in range(len(target)):
        x, y = target[i].real, target[i].imag
        leaf = leaf_at(m, x, y)
        total = far_field(m, leaf, x, y)
        u, v = total[0], total[1]
        for item in range(integer(m, NEAR_START, leaf, 1, 0), integer(m, NEAR_START, leaf + 1, 1, 0)):
            k, place = integer(m, NEAR, item, 3, 0), integer(m, NEAR, item, 3, 1)
            if k == target_corner[i] and k >= 0:
                continue
            first, last = solved_nodes(m, k, place)
            if k < 0:
                if edge[first] == target_edge[i]:
                    continue
                ax, ay, bx, by = panel_ends(m, k, place, 0, x, y, x, y)
                zeta = -complex(ax + bx, ay + by) / complex(bx - ax, by - ay)
                if abs(zeta - 1.0) + abs(zeta + 1.0) < CLOSE:
                    legendre_moments(zeta, moments)
                    for degree in range(p):
                        u += pi * moments[degree] * coefficients[place, degree, 0]
                        v += pi * moments[degree] * coefficients[place, degree, 1]
                    continue
            s, n = row(m, SOURCES, 0, 0), len(edge)
            for j in range(s + first, s + last):
                rx, ry = m[j] - x, m[j + n] - y
                value = (m[j + 3 * n] * rx - m[j + 2 * n] * ry) / (rx * rx + ry * ry)
                value = 0.0 if edge[j - s] == target_edge[i] else value
                u += value * m[j + 4 * n]
                v += value * m[j + 5 * n]
        out[i, 0] -= u / pi
        out[i, 1] -= v / pi


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


def _grown(m: MapArrays, *, opened: bool) -> MapArrays:
    """Divide the leaves of a map, valid if large, until few sources are near any of them.

    ``opened``: whether corners may be opened into their rings, and panels have their refined densities.
    """
    first = m.corner_index[:, 0]
    per_panel = (m.sources.shape[1] - first[-1]) // max(len(m.panels), 1)
    most = int(max(REFINED_NODES, per_panel, *np.diff(first), 2 * m.corner_index[:, 2].max()))
    flat, scratch = flatten(m, np.zeros(2), 0.0), np.empty((6, most))
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


@compiled
def _sort_out(
    m: FlatMap, opened: bool, square: FloatArray, state: IntArray, series: FloatArray,
    start: IntArray, near: IntArray, nodes: FloatArray, todo: IntArray,
) -> tuple[IntArray, IntArray, IntArray]:  # fmt: skip
    """Add to each box's series what is far from it, and find its state.

    Args:
        m: The map.
        opened: As for `_grown`.
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
                factor = _TAIL if place < 0 else (_REFINED if opened else FAR)
                if seen[0] >= _REACH * radius and seen[1] - radius >= factor * seen[2]:
                    add_to_series(m, k, place, level, opened, seen, x, y, radius, nodes, series, box)
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
        # A division may remove sources that are shorter than the box, but not those of a vertex in it: it
        # would find the same again.
        own, closest = -1, 1.5 * radius
        for item in range(first[box], end):
            k = kept[item, 0]
            if k >= 0:
                corner = row(m, CORNERS, k, 15)
                distance = np.sqrt((m[corner] - x) ** 2 + (m[corner + 1] - y) ** 2)
                if distance < closest:
                    own, closest = k, distance
        for item in range(first[box], end):
            k, place, level = kept[item, 0], kept[item, 1], kept[item, 2]
            if (k != own or k < 0) and seen_from(m, k, place, level, x, y)[2] < radius:
                gain[box] += 1 if place >= 0 else _CORNER
        if state[box] == ON_BOUNDARY and nearest > radius:
            inside, _, _ = among_walls(m, row(m, EDGES, 0, 4), length_of(m, EDGES, 0), x, y)
            state[box] = INSIDE if inside else OUTSIDE
        if state[box] == OUTSIDE:  # no point is ever looked for there
            end, gain[box] = first[box], 0
        first[box + 1] = end
    return first, kept[:end], gain


@compiled(borrows=True)
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
