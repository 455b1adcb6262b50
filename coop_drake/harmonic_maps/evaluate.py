"""Evaluates a map and its Jacobian at a point: a series for what is far, panels and corners for the rest.

A solved map is one array of numbers. Compiled code takes about a microsecond for every array that Python
hands to it, and its compile time grows with the number of arrays that its functions pass to each other.

Near panels go through Legendre functions of the second kind, which are exact for the panel's polynomial
density up to the wall itself: with zeta the point in the panel's own coordinate, the integral of
P_k(x) / (x - zeta) over [-1, 1] is -2 Q_k(zeta). Near a corner its dyadic rings are the panels.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from coop_drake.geometry.polygons import nearest_fraction, ray_crosses, squared_distance
from coop_drake.harmonic_maps.panels import gauss_nodes
from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray, IntArray

REFINED_NODES = 20
"""Gauss nodes on a panel after the density has been interpolated."""
ORDER = 28
"""Terms of the power series of a leaf: with sources at 2.8 radii and more, the rest is below 1e-12."""
LEVELS = 44
"""Dyadic rings kept at each corner: they reach down to 6e-14 of its legs."""
ON_BOUNDARY, INSIDE, OUTSIDE = 0, 1, 2
"""State of a leaf of the quadtree: a wall may cross it, or it lies on one side of all walls."""

_QUADRATURE = 2.9
"""|zeta - 1| + |zeta + 1| below which the Gauss nodes are too few and the Legendre functions are needed
[-]."""
FAR = 2.2
"""|zeta| from which the solved nodes of a panel are enough to integrate over it [-]."""
_JUNCTION = 1e-6
"""The Jacobian is taken no closer than this to where two panels meet, where it has a logarithm [half
panels]."""
_GAUSS_X, _GAUSS_W = gauss_nodes(REFINED_NODES)

FlatMap = FloatArray
"""A map in one array of floats: the centre (x, y) and the rounding [m]; for every array of `MapArrays` where
it begins and its lengths along four axes, -1 for an axis that it does not have; then the arrays one after the
other. Integers are stored as floats, which hold them exactly."""

_HEAD = 3
"""Numbers before the table: centre and rounding."""
_ENTRY = 5
"""Numbers in the table for each array: its start and four lengths."""


class MapArrays(NamedTuple):
    """The arrays of a map, for the code that builds, tests and inspects maps.

    A source of the field is named by three integers (corner, place, level): (-1, k, 0) is regular panel k,
    (k, j, level) is panel j of a ring of corner k, and (k, -1, level) is all of corner k from a level down.

    Attributes:
        edges: Rows (x0, y0, x1, y1), shape (edges, 4) [m].
        sources: Rows x, y, dx, dy, mu_u, mu_v of the solved nodes, shape (6, n).
        corners: Rows (vertex, back, out, inward bisector as x y, leg, ends of the incoming and the outgoing
            leg as x y, image), shape (corners, 15). Panels share their ends with these to the last bit.
        corner_index: Rows (first source, panels of a ring on one leg, leg nodes n, first grid node, first
            ring break, first ring density, first tail), shape (corners + 1, 7).
        grid: Rows (distance, weight) of leg grids scaled to [0, 1], shape (., 2).
        breaks: Ring breakpoints scaled to [1/2, 1].
        densities: Values, then Legendre coefficients, of the density on every regular panel and then on every
            ring panel, shape (., 2, REFINED_NODES, 2).
        tails: Weight-corrected density of the legs at every level, shape (., 2).
        panels: Rows (start, end) as x y of regular panels, shape (panels, 4) [m].
        root: Centre and half side of the square that the quadtree divides, shape (3,) [m].
        boxes: For each box of the quadtree the first of its four quarters, or -1 - leaf, shape (boxes,).
        leaf_square: Centre and half diagonal of each leaf, shape (leaves, 3) [m].
        leaf_state: `ON_BOUNDARY`, `INSIDE` or `OUTSIDE`, shape (leaves,).
        local: Power series in units of the half diagonal of what is far from each leaf: rows of real and
            imaginary parts for u and for v, shape (leaves, ORDER, 4).
        near_start: First row of each leaf in ``near``, and the end, shape (leaves + 1,).
        near: Sources (corner, place, level) near each leaf, shape (., 3).
    """

    edges: FloatArray
    sources: FloatArray
    corners: FloatArray
    corner_index: IntArray
    grid: FloatArray
    breaks: FloatArray
    densities: FloatArray
    tails: FloatArray
    panels: FloatArray
    root: FloatArray
    boxes: IntArray
    leaf_square: FloatArray
    leaf_state: IntArray
    local: FloatArray
    near_start: IntArray
    near: IntArray


(EDGES, SOURCES, CORNERS, CORNER_INDEX, GRID, BREAKS, DENSITIES, TAILS, PANELS,
 ROOT, BOXES, LEAF_SQUARE, LEAF_STATE, LOCAL, NEAR_START, NEAR) = range(len(MapArrays._fields))  # fmt: skip

_INTEGERS = (CORNER_INDEX, BOXES, LEAF_STATE, NEAR_START, NEAR)


def flatten(arrays: MapArrays, centre: FloatArray, rounding: float) -> FlatMap:
    """Lay out a map in one array, with the origin of its coordinates in W, shape (2,) [m].

    ``rounding``: how far outside still counts as on the wall [m].
    """
    table = np.full((len(arrays), _ENTRY), -1.0)
    start = _HEAD + table.size
    for entry, array in zip(table, arrays, strict=True):
        entry[0] = start
        entry[1 : 1 + array.ndim] = array.shape
        start += array.size
    parts = (np.array([*centre, rounding]), table, *arrays)
    return np.concatenate([np.asarray(part, dtype=float).reshape(-1) for part in parts])


def unflatten(flat: FlatMap) -> MapArrays:
    """The map's arrays: views of the floats, copies of the integers."""
    table = flat[_HEAD : _HEAD + _ENTRY * len(MapArrays._fields)].reshape(-1, _ENTRY).astype(np.int64)
    arrays: list[np.ndarray] = []
    for k, (start, *lengths) in enumerate(table.tolist()):
        shape = [length for length in lengths if length >= 0]
        array = flat[start : start + int(np.prod(shape))].reshape(shape)
        arrays.append(array.astype(np.int64) if k in _INTEGERS else array)
    return MapArrays(*arrays)


@compiled(borrows=True)
def row(flat: FlatMap, array: int, k: int, width: int) -> int:
    """Where row k of an array begins, whose rows hold ``width`` numbers."""
    return int(flat[_HEAD + array * _ENTRY]) + k * width


@compiled(borrows=True)
def length_of(flat: FlatMap, array: int, axis: int) -> int:
    """How long an array is along an axis: its number of rows, or of columns."""
    return int(flat[_HEAD + array * _ENTRY + 1 + axis])


@compiled(borrows=True)
def integer(flat: FlatMap, array: int, k: int, width: int, column: int) -> int:
    """The integer in row k and a column of an array whose rows hold ``width`` numbers."""
    return int(flat[row(flat, array, k, width) + column])


@compiled(borrows=True)
def among_walls(numbers: FloatArray, first: int, count: int, x: float, y: float) -> tuple[bool, float, float]:
    """Whether a point is inside, and the nearest point of the walls if not, else the point itself.

    It is inside where a ray to the right crosses an odd number of walls. The walls of all
    rings, so many, stand one after the other in an array, from index ``first`` on.
    """
    inside, best, bx, by = False, np.inf, x, y
    for e in range(first, first + 4 * count, 4):
        if ray_crosses(x, y, numbers[e], numbers[e + 1], numbers[e + 2], numbers[e + 3]):
            inside = not inside
    for e in range(first, first if inside else first + 4 * count, 4):
        x0, y0, x1, y1 = numbers[e], numbers[e + 1], numbers[e + 2], numbers[e + 3]
        t = nearest_fraction(x, y, x0, y0, x1, y1)
        px, py = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
        distance = (px - x) ** 2 + (py - y) ** 2
        if distance < best:
            best, bx, by = distance, px, py
    return inside, bx, by


Sums = tuple[float, float, float, float, float, float, float, float]
"""2 pi times (u, v, u_x, u_y, v_x, v_y) of some of the sources, and a step (x, y) [m] off the wall if the
point is where two panels meet, otherwise (0, 0)."""


@compiled
def _add(a: Sums, b: Sums) -> Sums:
    """Sum of two contributions."""
    (a0, a1, a2, a3, a4, a5, a6, a7), (b0, b1, b2, b3, b4, b5, b6, b7) = a, b
    return a0 + b0, a1 + b1, a2 + b2, a3 + b3, a4 + b4, a5 + b5, a6 + b6, a7 + b7


@compiled(borrows=True)
def _density_of(m: FlatMap, k: int, place: int, level: int) -> int:
    """Where the density of panel (k, place, level) stands: values, then Legendre coefficients."""
    index = place
    if k >= 0:
        index = integer(m, CORNER_INDEX, k, 7, 5) + 2 * level * integer(m, CORNER_INDEX, k, 7, 1) + place
    return row(m, DENSITIES, index, 4 * REFINED_NODES)


@compiled(borrows=True)
def panel_ends(
    m: FlatMap, k: int, place: int, level: int, x: float, y: float, rx: float, ry: float
) -> tuple[float, float, float, float]:
    """Ends of panel (k, place, level), as in `MapArrays`, in the boundary's direction, seen from a point.

    The point is (x, y) [m], and (rx, ry) seen from the vertex of corner k [m], which is more precise than the
    difference where the point was moved.
    """
    if k < 0:
        p = row(m, PANELS, place, 4)
        return m[p] - x, m[p + 1] - y, m[p + 2] - x, m[p + 3] - y
    panels, first = integer(m, CORNER_INDEX, k, 7, 1), integer(m, CORNER_INDEX, k, 7, 4)
    corner, breaks = row(m, CORNERS, k, 15), row(m, BREAKS, first + place % panels, 1)
    leg = 2 * (place // panels)
    scale = m[corner + 8] * 0.5**level
    dx, dy = scale * m[corner + 2 + leg], scale * m[corner + 3 + leg]
    a, b = m[breaks], m[breaks + 1]
    ax, ay, bx, by = a * dx - rx, a * dy - ry, b * dx - rx, b * dy - ry
    if level == 0 and place % panels == panels - 1:
        bx, by = m[corner + 9 + leg] - x, m[corner + 10 + leg] - y
    if leg == 0:
        return bx, by, ax, ay
    return ax, ay, bx, by


@compiled
def _panel_sums(
    m: FlatMap, k: int, place: int, level: int, x: float, y: float, rx: float, ry: float, rounding: float
) -> Sums:
    """Field of panel (k, place, level) at a point, with the arguments of `panel_ends`.

    Neighbours that share an end to the last bit never miss or count twice a point between them.
    """
    ax, ay, bx, by = panel_ends(m, k, place, level, x, y, rx, ry)
    density = _density_of(m, k, place, level)
    hx, hy = 0.5 * (bx - ax), 0.5 * (by - ay)
    squared = hx * hx + hy * hy
    # zeta + 1 and zeta - 1.
    px, py = -(ax * hx + ay * hy) / squared, (ax * hy - ay * hx) / squared
    mx, my = -(bx * hx + by * hy) / squared, (bx * hy - by * hx) / squared
    plus, minus = px * px + py * py, mx * mx + my * my
    zx, zy = 0.5 * (px + mx), 0.5 * (py + my)
    step = 0.0
    # Imaginary parts of the integrals for u and v; real and imaginary parts of their derivatives.
    tu, tv, ru, iu, rv, iv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if np.sqrt(plus) + np.sqrt(minus) > _QUADRATURE:
        for j in range(REFINED_NODES):
            to_x = _GAUSS_X[j] - zx
            inverse = 1.0 / (to_x * to_x + zy * zy)
            re, im = to_x * inverse, zy * inverse
            u, v = _GAUSS_W[j] * m[density + 2 * j], _GAUSS_W[j] * m[density + 2 * j + 1]
            re2, im2 = re * re - im * im, 2.0 * re * im
            tu += u * im
            tv += v * im
            ru += u * re2
            iu += u * im2
            rv += v * re2
            iv += v * im2
    else:
        start = np.arctan2(py, px) if plus > 0.0 else 0.0
        end = np.arctan2(my, mx) if minus > 0.0 else 0.0  # on a shared end, exactly one of two panels sees it
        # The cut is the panel itself; a point that rounding put behind it still sees it from the domain's
        # side.
        if -my * np.sqrt(squared) < rounding:
            start = start if start > -0.5 * pi else start + 2.0 * pi
            end = end if end > -0.5 * pi else end + 2.0 * pi
        q0 = complex(0.25 * np.log(max(plus, 1e-60) / max(minus, 1e-60)), 0.5 * (start - end))
        d0 = -1.0 / (complex(px, py) * complex(mx, my) + (1e-60 if plus * minus == 0.0 else 0.0))
        # (k + 1) Q_{k+1} = (2 k + 1) zeta Q_k - k Q_{k-1}, and Q'_{k+1} = Q'_{k-1} + (2 k + 1) Q_k.
        zeta, coefficients = complex(zx, zy), density + 2 * REFINED_NODES
        q1, d1 = zeta * q0 - 1.0, q0 + zeta * d0
        u, v = m[coefficients], m[coefficients + 1]
        tu, tv, du, dv = u * q0.imag, v * q0.imag, u * d0, v * d0
        for k in range(1, REFINED_NODES):
            u, v = m[coefficients + 2 * k], m[coefficients + 2 * k + 1]
            tu += u * q1.imag
            tv += v * q1.imag
            du += u * d1
            dv += v * d1
            q0, q1, d0, d1 = q1, ((2 * k + 1) * zeta * q1 - k * q0) / (k + 1), d1, d0 + (2 * k + 1) * q1
        tu, tv = -2.0 * tu, -2.0 * tv
        ru, iu, rv, iv = -2.0 * du.real, -2.0 * du.imag, -2.0 * dv.real, -2.0 * dv.imag
        if min(plus, minus) < _JUNCTION * _JUNCTION:
            step = 2.0 * _JUNCTION
    # The derivatives with respect to zeta, divided by h, are those with respect to x + i y.
    gx, gy = hx / squared, hy / squared
    return (
        tu, tv, iu * gx - ru * gy, ru * gx + iu * gy, iv * gx - rv * gy, rv * gx + iv * gy,
        -step * hy, step * hx,
    )  # fmt: skip


@compiled
def _corner_sums(m: FlatMap, k: int, level: int, x: float, y: float, rounding: float) -> tuple[Sums, bool]:
    """Field of one corner from a level down, at a point not far from it; at the vertex, just inside of it.

    And whether the point counts as the vertex.
    """
    corner = row(m, CORNERS, k, 15)
    rx, ry = x - m[corner], y - m[corner + 1]
    radius = max(2.0 * m[corner + 8] * 0.5**LEVELS, 4.0 * rounding)
    at_vertex = rx * rx + ry * ry < radius * radius
    if at_vertex:
        rx, ry = radius * m[corner + 6], radius * m[corner + 7]
    total = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    distance, scale = np.hypot(rx, ry), m[corner + 8] * 0.5**level
    while level < LEVELS and distance < 2.0 * scale:
        for place in range(2 * integer(m, CORNER_INDEX, k, 7, 1)):
            total = _add(total, _panel_sums(m, k, place, level, x, y, rx, ry, rounding))
        scale *= 0.5
        level += 1
    # From here the legs down from this level are seen from afar, through their compressed density.
    tu, tv, xu, yu, xv, yv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    n, grid = integer(m, CORNER_INDEX, k, 7, 2), row(m, GRID, integer(m, CORNER_INDEX, k, 7, 3), 2)
    tail = row(m, TAILS, integer(m, CORNER_INDEX, k, 7, 6) + 2 * level * n, 2)
    scale = m[corner + 8] * 0.5**level
    for leg in range(2):
        dx, dy = scale * m[corner + 2 + 2 * leg], scale * m[corner + 3 + 2 * leg]
        sign, own = 2.0 * leg - 1.0, tail + 2 * leg * n
        for j in range(n):
            s, w = m[grid + 2 * j], sign * m[grid + 2 * j + 1]
            px, py = s * dx - rx, s * dy - ry
            inverse = 1.0 / (px * px + py * py)
            px, py = px * inverse, py * inverse
            re, im = w * (dx * px + dy * py), w * (dy * px - dx * py)
            re2, im2 = re * px + im * py, im * px - re * py
            u, v = m[own + 2 * j], m[own + 2 * j + 1]
            tu += u * im
            tv += v * im
            xu += u * im2
            yu += u * re2
            xv += v * im2
            yv += v * re2
    return _add(total, (tu, tv, xu, yu, xv, yv, 0.0, 0.0)), bool(at_vertex)


@compiled(borrows=True)
def seen_from(m: FlatMap, k: int, place: int, level: int, x: float, y: float) -> tuple[float, float, float]:
    """How a source is seen from a point [m].

    Returns:
        Its distance; the distance of a panel's middle or of a corner's vertex; the half length of a panel or
        the length of a corner's legs, all [m].
    """
    corner = row(m, CORNERS, max(k, 0), 15)
    rx, ry = x - m[corner], y - m[corner + 1]
    if place >= 0:
        ax, ay, bx, by = panel_ends(m, k, place, level, x, y, rx, ry)
        middle = 0.5 * np.sqrt((ax + bx) ** 2 + (ay + by) ** 2)
        half = 0.5 * np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
        return np.sqrt(squared_distance(0.0, 0.0, ax, ay, bx, by)), middle, half
    leg, nearest = m[corner + 8] * 0.5**level, np.inf
    for side in range(2):
        ax, ay = leg * m[corner + 2 + 2 * side] - rx, leg * m[corner + 3 + 2 * side] - ry
        nearest = min(nearest, np.sqrt(squared_distance(0.0, 0.0, ax, ay, -rx, -ry)))
    return nearest, np.sqrt(rx * rx + ry * ry), leg


@compiled(borrows=True)
def solved_nodes(m: FlatMap, k: int, place: int) -> tuple[int, int]:
    """Index range [first, end) of the solved nodes of a regular panel or of a corner's block."""
    if k >= 0:
        return integer(m, CORNER_INDEX, k, 7, 0), integer(m, CORNER_INDEX, k + 1, 7, 0)
    regular = integer(m, CORNER_INDEX, length_of(m, CORNERS, 0), 7, 0)
    count = (length_of(m, SOURCES, 1) - regular) // length_of(m, PANELS, 0)
    return regular + place * count, regular + (place + 1) * count


@compiled(borrows=True)
def add_to_series(
    m: FlatMap, k: int, place: int, level: int, opened: bool, seen: tuple[float, float, float],
    x: float, y: float, radius: float, nodes: FloatArray, series: FloatArray, box: int,
) -> None:  # fmt: skip
    """Add a source that is far from a box to the box's power series.

    The source is ``seen`` from the box's centre (x, y) [m]; ``radius`` is the half diagonal of the box [m],
    ``opened`` whether refined densities are known, ``nodes`` scratch of shape (6, .). Series are in units of
    the radius: real and imaginary parts for u, then for v, shape (boxes, degrees, 4). A node at t adds
    mu dt / t^(k + 1) to the coefficient of degree k, t seen from the box's centre.
    """
    # Columns of nodes: position seen from the centre, line element, mu_u, mu_v.
    corner = row(m, CORNERS, max(k, 0), 15)
    if (place < 0 and level == 0) or (k < 0 and (not opened or seen[1] - radius >= FAR * seen[2])):
        first, last = solved_nodes(m, k, place)
        sources, n = row(m, SOURCES, 0, 0), length_of(m, SOURCES, 1)
        for j in range(first, last):
            for i in range(6):
                nodes[i, j - first] = m[sources + i * n + j]
            nodes[0, j - first] -= x
            nodes[1, j - first] -= y
        count = last - first
    elif place < 0:  # The corner's compressed density at the level.
        n, grid = integer(m, CORNER_INDEX, k, 7, 2), row(m, GRID, integer(m, CORNER_INDEX, k, 7, 3), 2)
        tail = row(m, TAILS, integer(m, CORNER_INDEX, k, 7, 6) + 2 * level * n, 2)
        scale = m[corner + 8] * 0.5**level
        for i in range(2 * n):
            leg, j = i // n, i % n
            dx, dy = scale * m[corner + 2 + 2 * leg], scale * m[corner + 3 + 2 * leg]
            s, w = m[grid + 2 * j], (2.0 * leg - 1.0) * m[grid + 2 * j + 1]
            nodes[0, i], nodes[1, i] = m[corner] - x + s * dx, m[corner + 1] - y + s * dy
            nodes[2, i], nodes[3, i] = w * dx, w * dy
            nodes[4, i], nodes[5, i] = m[tail + 2 * i], m[tail + 2 * i + 1]
        count = 2 * n
    else:
        ax, ay, bx, by = panel_ends(m, k, place, level, x, y, x - m[corner], y - m[corner + 1])
        density = _density_of(m, k, place, level)
        hx, hy = 0.5 * (bx - ax), 0.5 * (by - ay)
        for j in range(REFINED_NODES):
            nodes[0, j], nodes[1, j] = 0.5 * (ax + bx) + _GAUSS_X[j] * hx, 0.5 * (ay + by) + _GAUSS_X[j] * hy
            nodes[2, j], nodes[3, j] = _GAUSS_W[j] * hx, _GAUSS_W[j] * hy
            nodes[4, j], nodes[5, j] = m[density + 2 * j], m[density + 2 * j + 1]
        count = REFINED_NODES
    # From here nodes[:2] are radius / t, and nodes[2:4] are dt / t times the power of it for the degree.
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


@compiled(borrows=True)
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


@compiled(borrows=True)
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


@compiled(borrows=True)
def _all_sums(m: FlatMap, x: float, y: float) -> tuple[Sums, int]:
    """Sums over the whole boundary at a point of the square; and the vertex that it counts as, or -1."""
    leaf, vertex, rounding = leaf_at(m, x, y), -1, m[2]
    total = far_field(m, leaf, x, y)
    for item in range(integer(m, NEAR_START, leaf, 1, 0), integer(m, NEAR_START, leaf + 1, 1, 0)):
        k, place, level = (
            integer(m, NEAR, item, 3, 0),
            integer(m, NEAR, item, 3, 1),
            integer(m, NEAR, item, 3, 2),
        )
        if place < 0:
            part, at_vertex = _corner_sums(m, k, level, x, y, rounding)
            vertex = k if at_vertex else vertex
        else:
            corner = row(m, CORNERS, max(k, 0), 15)
            part = _panel_sums(m, k, place, level, x, y, x - m[corner], y - m[corner + 1], rounding)
        total = _add(total, part)
    return total, vertex


@compiled(borrows=True)
def evaluate_one(m: FlatMap, x: float, y: float) -> tuple[float, float, float, float, float, float]:
    """u, v, u_x, u_y, v_x, v_y at a point relative to the map's centre [-, 1/m].

    A point outside has the values of the nearest point of the walls.
    A point that is behind a wall by less than the map's rounding counts as on the wall. At a vertex T is that
    of the vertex and J that of a point just inside; where two panels meet, J is that of a point just off the
    wall.
    """
    if integer(m, LEAF_STATE, leaf_at(m, x, y), 1, 0) != INSIDE:
        _, x, y = among_walls(m, row(m, EDGES, 0, 4), length_of(m, EDGES, 0), x, y)
    (tu, tv, xu, yu, xv, yv, step_x, step_y), vertex = _all_sums(m, x, y)
    if step_x != 0.0 or step_y != 0.0:
        (_, _, xu, yu, xv, yv, _, _), _ = _all_sums(m, x + step_x, y + step_y)
    c = 0.5 / pi
    if vertex >= 0:
        image = row(m, CORNERS, vertex, 15) + 13
        return m[image], m[image + 1], c * xu, c * yu, c * xv, c * yv
    return c * tu, c * tv, c * xu, c * yu, c * xv, c * yv


@compiled
def evaluate_many(m: FlatMap, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Images (n, 2) [-] and Jacobians (n, 2, 2) [1/m] of points (n, 2) relative to the map's centre [m]."""
    images, jacobians = np.empty((len(points), 2)), np.empty((len(points), 2, 2))
    for i in range(len(points)):
        values = evaluate_one(m, points[i, 0], points[i, 1])
        for k in range(2):
            images[i, k] = values[k]
            jacobians[i, 0, k], jacobians[i, 1, k] = values[2 + k], values[4 + k]
    return images, jacobians
