"""Panels and corners seen from close by, in compiled code.

Near panels go through Legendre functions of the second kind, which are exact for the panel's polynomial
density up to the wall itself: with zeta the point in the panel's own coordinate, the integral of
P_k(x) / (x - zeta) over [-1, 1] is -2 Q_k(zeta). Near a corner its dyadic rings are the panels.
"""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.flat_map import (
    BREAKS,
    CORNER_INDEX,
    CORNERS,
    DENSITIES,
    GRID,
    LEVELS,
    PANELS,
    REFINED_NODES,
    TAILS,
    FlatMap,
    integer,
    row,
)
from coop_drake.fields.quadrature import gauss_nodes

_NEAR = 2.9
"""|zeta - 1| + |zeta + 1| below which the Gauss nodes are too few and the Legendre functions are needed
[-]."""
_JUNCTION = 1e-6
"""The Jacobian is taken no closer than this to where two panels meet, where it has a logarithm [half
panels]."""
_GAUSS_X, _GAUSS_W = gauss_nodes(REFINED_NODES)

Sums = tuple[float, float, float, float, float, float, float, float]
"""2 pi times (u, v, u_x, u_y, v_x, v_y) of some of the sources, and a step (x, y) [m] off the wall if the
point is where two panels meet, otherwise (0, 0)."""


@compiled(reassociate=True)
def add(a: Sums, b: Sums) -> Sums:
    """Sum of two contributions."""
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
    )


@compiled(reassociate=True)
def density_of(m: FlatMap, k: int, place: int, level: int) -> int:
    """Where the density of panel (k, place, level) stands: values, then Legendre coefficients."""
    index = place
    if k >= 0:
        index = integer(m, CORNER_INDEX, k, 7, 5) + 2 * level * integer(m, CORNER_INDEX, k, 7, 1) + place
    return row(m, DENSITIES, index, 4 * REFINED_NODES)


@compiled(reassociate=True)
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


@compiled(reassociate=True)
def panel_sums(
    m: FlatMap, k: int, place: int, level: int, x: float, y: float, rx: float, ry: float, rounding: float
) -> Sums:
    """Field of panel (k, place, level) at a point, with the arguments of `panel_ends`.

    Neighbours that share an end to the last bit never miss or count twice a point between them.
    """
    ax, ay, bx, by = panel_ends(m, k, place, level, x, y, rx, ry)
    density = density_of(m, k, place, level)
    hx, hy = 0.5 * (bx - ax), 0.5 * (by - ay)
    squared = hx * hx + hy * hy
    # zeta + 1 and zeta - 1.
    px, py = -(ax * hx + ay * hy) / squared, (ax * hy - ay * hx) / squared
    mx, my = -(bx * hx + by * hy) / squared, (bx * hy - by * hx) / squared
    plus, minus = px * px + py * py, mx * mx + my * my
    zx, zy = 0.5 * (px + mx), 0.5 * (py + my)
    step = 0.0
    if np.sqrt(plus) + np.sqrt(minus) > _NEAR:
        tu, tv, ru, iu, rv, iv = _gauss(m, density, zx, zy)
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
        tu, tv, ru, iu, rv, iv = _legendre(m, density + 2 * REFINED_NODES, complex(zx, zy), q0, d0)
        if min(plus, minus) < _JUNCTION * _JUNCTION:
            step = 2.0 * _JUNCTION
    # The derivatives with respect to zeta, divided by h, are those with respect to x + i y.
    gx, gy = hx / squared, hy / squared
    return (
        tu, tv, iu * gx - ru * gy, ru * gx + iu * gy, iv * gx - rv * gy, rv * gx + iv * gy,
        -step * hy, step * hx,
    )  # fmt: skip


@compiled(reassociate=True)
def _gauss(m: FlatMap, values: int, zx: float, zy: float) -> tuple[float, float, float, float, float, float]:
    """Imaginary parts of the two integrals, real and imaginary parts of their derivatives, by quadrature."""
    tu, tv, ru, iu, rv, iv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(REFINED_NODES):
        rx = _GAUSS_X[j] - zx
        inverse = 1.0 / (rx * rx + zy * zy)
        re, im = rx * inverse, zy * inverse
        u, v = _GAUSS_W[j] * m[values + 2 * j], _GAUSS_W[j] * m[values + 2 * j + 1]
        re2, im2 = re * re - im * im, 2.0 * re * im
        tu += u * im
        tv += v * im
        ru += u * re2
        iu += u * im2
        rv += v * re2
        iv += v * im2
    return tu, tv, ru, iu, rv, iv


@compiled(reassociate=True)
def _legendre(
    m: FlatMap, coefficients: int, zeta: complex, q0: complex, d0: complex
) -> tuple[float, float, float, float, float, float]:
    """The same as `_gauss` through Q_k and its derivative, from their values q0 and d0 for k = 0.

    The recurrence is (k + 1) Q_{k+1} = (2 k + 1) zeta Q_k - k Q_{k-1}, and Q'_{k+1} = Q'_{k-1} + (2 k + 1)
    Q_k.
    """
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
    return -2.0 * tu, -2.0 * tv, -2.0 * du.real, -2.0 * du.imag, -2.0 * dv.real, -2.0 * dv.imag


@compiled(reassociate=True)
def _tail(m: FlatMap, k: int, level: int, rx: float, ry: float) -> Sums:
    """The legs of corner k from a level down, seen from afar, through their compressed density."""
    tu, tv, xu, yu, xv, yv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    n, grid = integer(m, CORNER_INDEX, k, 7, 2), row(m, GRID, integer(m, CORNER_INDEX, k, 7, 3), 2)
    tail = row(m, TAILS, integer(m, CORNER_INDEX, k, 7, 6) + 2 * level * n, 2)
    corner = row(m, CORNERS, k, 15)
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
    return tu, tv, xu, yu, xv, yv, 0.0, 0.0


@compiled(reassociate=True)
def _vertex_radius(m: FlatMap, k: int, rounding: float) -> float:
    """Distance from a vertex below which points count as the vertex [m]."""
    return max(2.0 * float(m[row(m, CORNERS, k, 15) + 8]) * 0.5**LEVELS, 4.0 * rounding)


@compiled(reassociate=True)
def is_at_vertex(m: FlatMap, k: int, x: float, y: float, rounding: float) -> bool:
    """Whether a point counts as the vertex of a corner."""
    corner, radius = row(m, CORNERS, k, 15), _vertex_radius(m, k, rounding)
    rx, ry = x - m[corner], y - m[corner + 1]
    return bool(rx * rx + ry * ry < radius * radius)


@compiled(reassociate=True)
def corner_sums(m: FlatMap, k: int, level: int, x: float, y: float, rounding: float) -> Sums:
    """Field of one corner from a level down, at a point not far from it; at the vertex, just inside of it."""
    corner = row(m, CORNERS, k, 15)
    rx, ry = x - m[corner], y - m[corner + 1]
    if is_at_vertex(m, k, x, y, rounding):
        radius = _vertex_radius(m, k, rounding)
        rx, ry = radius * m[corner + 6], radius * m[corner + 7]
    total = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    distance, scale = np.hypot(rx, ry), m[corner + 8] * 0.5**level
    while level < LEVELS and distance < 2.0 * scale:
        for place in range(2 * integer(m, CORNER_INDEX, k, 7, 1)):
            total = add(total, panel_sums(m, k, place, level, x, y, rx, ry, rounding))
        scale *= 0.5
        level += 1
    return add(total, _tail(m, k, level, rx, ry))
