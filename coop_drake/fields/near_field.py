"""Panels and corners seen from close by, in machine code.

Near panels go through Legendre functions of the second kind, which are exact for the panel's polynomial
density up to the wall itself: with zeta the point in the panel's own coordinate, the integral of
P_k(x) / (x - zeta) over [-1, 1] is -2 Q_k(zeta). Near a corner its dyadic rings are the panels.
"""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.layers import LEVELS, REFINED_NODES, MapArrays
from coop_drake.fields.quadrature import FloatArray, gauss_nodes

__all__ = ["Sums", "add", "corner", "is_at_vertex", "regular", "ring", "ring_ends"]

_NEAR = 2.9  # |zeta - 1| + |zeta + 1| below which the Legendre functions are needed
_JUNCTION = 1e-6  # the Jacobian is taken no closer than this to where two panels meet, in half panels
_GAUSS_X, _GAUSS_W = gauss_nodes(REFINED_NODES)

Sums = tuple[float, float, float, float, float, float]


@compiled(reassociate=True)
def _panel(density: FloatArray, ax: float, ay: float, bx: float, by: float, tolerance: float) -> Sums:
    """One panel from a to b, both seen from the point, with density (2, REFINED, 2).

    Neighbours that share an end to the last bit never miss or count twice a point between them.
    """
    hx, hy = 0.5 * (bx - ax), 0.5 * (by - ay)
    squared = hx * hx + hy * hy
    # zeta + 1 and zeta - 1.
    px, py = -(ax * hx + ay * hy) / squared, (ax * hy - ay * hx) / squared
    mx, my = -(bx * hx + by * hy) / squared, (bx * hy - by * hx) / squared
    plus, minus = px * px + py * py, mx * mx + my * my
    if np.sqrt(plus) + np.sqrt(minus) > _NEAR:
        return _turned(_gauss(density, 0.5 * (px + mx), 0.5 * (py + my)), hx, hy)
    start = np.arctan2(py, px) if plus > 0.0 else 0.0
    end = np.arctan2(my, mx) if minus > 0.0 else 0.0  # on a shared end, exactly one of two panels sees it
    # The cut is the panel itself; a point that rounding put behind it still sees it from the domain's side.
    if -my * np.sqrt(squared) < tolerance:
        start = start if start > -0.5 * pi else start + 2.0 * pi
        end = end if end > -0.5 * pi else end + 2.0 * pi
    q0 = complex(0.25 * np.log(max(plus, 1e-60) / max(minus, 1e-60)), 0.5 * (start - end))
    d0 = -1.0 / (complex(px, py) * complex(mx, my) + (1e-60 if plus * minus == 0.0 else 0.0))
    return _turned(_legendre(density[1], complex(0.5 * (px + mx), 0.5 * (py + my)), q0, d0), hx, hy)


@compiled(reassociate=True)
def _gauss(density: FloatArray, zx: float, zy: float) -> Sums:
    """Imaginary parts of the two integrals, real and imaginary parts of their derivatives, by quadrature."""
    tu, tv, ru, iu, rv, iv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(REFINED_NODES):
        rx = _GAUSS_X[j] - zx
        inverse = 1.0 / (rx * rx + zy * zy)
        re, im = rx * inverse, zy * inverse
        u, v = _GAUSS_W[j] * density[0, j, 0], _GAUSS_W[j] * density[0, j, 1]
        re2, im2 = re * re - im * im, 2.0 * re * im
        tu += u * im
        tv += v * im
        ru += u * re2
        iu += u * im2
        rv += v * re2
        iv += v * im2
    return tu, tv, ru, iu, rv, iv


@compiled(reassociate=True)
def _legendre(c: FloatArray, zeta: complex, q0: complex, d0: complex) -> Sums:
    """The same through Q_k and its derivative, from their values for k = 0."""
    q1, d1 = zeta * q0 - 1.0, q0 + zeta * d0
    tu = c[0, 0] * q0.imag + c[1, 0] * q1.imag
    tv = c[0, 1] * q0.imag + c[1, 1] * q1.imag
    du, dv = c[0, 0] * d0 + c[1, 0] * d1, c[0, 1] * d0 + c[1, 1] * d1
    for k in range(1, REFINED_NODES - 1):
        q2 = ((2 * k + 1) * zeta * q1 - k * q0) / (k + 1)
        d2 = d0 + (2 * k + 1) * q1
        q0, q1, d0, d1 = q1, q2, d1, d2
        u, v = c[k + 1, 0], c[k + 1, 1]
        tu += u * q2.imag
        tv += v * q2.imag
        du += u * d2
        dv += v * d2
    return -2.0 * tu, -2.0 * tv, -2.0 * du.real, -2.0 * du.imag, -2.0 * dv.real, -2.0 * dv.imag


@compiled(reassociate=True)
def _turned(s: Sums, hx: float, hy: float) -> Sums:
    """Divide the derivatives with respect to zeta, given by real and imaginary part, by h."""
    tu, tv, ru, iu, rv, iv = s
    inverse = 1.0 / (hx * hx + hy * hy)
    hx, hy = hx * inverse, hy * inverse
    return tu, tv, iu * hx - ru * hy, ru * hx + iu * hy, iv * hx - rv * hy, rv * hx + iv * hy


@compiled(reassociate=True)
def _away(ax: float, ay: float, bx: float, by: float) -> complex:
    """A step off the wall if the point, seen from which the panel runs from a to b, is at one of its ends."""
    hx, hy = 0.5 * (bx - ax), 0.5 * (by - ay)
    nearest = min(ax * ax + ay * ay, bx * bx + by * by)
    if nearest < _JUNCTION * _JUNCTION * (hx * hx + hy * hy):
        return complex(-hy, hx) * (2.0 * _JUNCTION)
    return 0j


@compiled(reassociate=True)
def add(a: Sums, b: Sums) -> Sums:
    """Sum of two contributions."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@compiled(reassociate=True)
def regular(m: MapArrays, k: int, x: float, y: float, tolerance: float) -> tuple[Sums, complex]:
    """A regular panel seen from a point; and a step away from a junction of panels, if one is at hand."""
    ax, ay, bx, by = m.panels[k, 0] - x, m.panels[k, 1] - y, m.panels[k, 2] - x, m.panels[k, 3] - y
    return _panel(m.panel_density[k], ax, ay, bx, by, tolerance), _away(ax, ay, bx, by)


@compiled(reassociate=True)
def ring_ends(
    m: MapArrays, k: int, level: int, place: int, x: float, y: float, rx: float, ry: float
) -> tuple[float, float, float, float]:
    """Ends of a ring panel of corner k, in the boundary's direction, seen from a point.

    Args:
        m: The map.
        k: The corner.
        level: Its ring, 0 the outermost.
        place: The panel of that ring, counted over the incoming and then the outgoing leg.
        x: The point [m].
        y: The point [m].
        rx: The point seen from the vertex [m]; more precise than the difference where it was moved.
        ry: The same in y.
    """
    panels, first = m.corner_index[k, 1], m.corner_index[k, 4]
    leg, j = place // panels, place % panels
    scale = m.corners[k, 8] * 0.5**level
    dx, dy = scale * m.corners[k, 2 + 2 * leg], scale * m.corners[k, 3 + 2 * leg]
    a, b = m.breaks[first + j], m.breaks[first + j + 1]
    ax, ay, bx, by = a * dx - rx, a * dy - ry, b * dx - rx, b * dy - ry
    if level == 0 and j == panels - 1:
        bx, by = m.corners[k, 9 + 2 * leg] - x, m.corners[k, 10 + 2 * leg] - y
    if leg == 0:
        return bx, by, ax, ay
    return ax, ay, bx, by


@compiled(reassociate=True)
def ring(
    m: MapArrays, k: int, level: int, place: int, x: float, y: float, rx: float, ry: float, tolerance: float
) -> tuple[Sums, complex]:
    """A ring panel of a corner seen from a point, with the arguments of `ring_ends`; and a step away."""
    ax, ay, bx, by = ring_ends(m, k, level, place, x, y, rx, ry)
    density = m.rings[m.corner_index[k, 5] + 2 * level * m.corner_index[k, 1] + place]
    return _panel(density, ax, ay, bx, by, tolerance), _away(ax, ay, bx, by)


@compiled(reassociate=True)
def _tail(m: MapArrays, k: int, level: int, rx: float, ry: float) -> Sums:
    """The corner's legs at one level, seen from afar, through their compressed density."""
    tu, tv, xu, yu, xv, yv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    n, grid, first = m.corner_index[k, 2], m.corner_index[k, 3], m.corner_index[k, 6]
    scale = m.corners[k, 8] * 0.5**level
    for leg in range(2):
        dx, dy = scale * m.corners[k, 2 + 2 * leg], scale * m.corners[k, 3 + 2 * leg]
        sign, row = 2.0 * leg - 1.0, first + (2 * level + leg) * n
        for j in range(n):
            s, w = m.grid[grid + j, 0], sign * m.grid[grid + j, 1]
            px, py = s * dx - rx, s * dy - ry
            inverse = 1.0 / (px * px + py * py)
            px, py = px * inverse, py * inverse
            re, im = w * (dx * px + dy * py), w * (dy * px - dx * py)
            re2, im2 = re * px + im * py, im * px - re * py
            u, v = m.tails[row + j, 0], m.tails[row + j, 1]
            tu += u * im
            tv += v * im
            xu += u * im2
            yu += u * re2
            xv += v * im2
            yv += v * re2
    return tu, tv, xu, yu, xv, yv


@compiled(reassociate=True)
def _floor(m: MapArrays, k: int, tolerance: float) -> float:
    """Distance from a vertex below which points are not told from it [m]."""
    return max(2.0 * float(m.corners[k, 8]) * 0.5**LEVELS, 4.0 * tolerance)


@compiled(reassociate=True)
def is_at_vertex(m: MapArrays, k: int, x: float, y: float, tolerance: float) -> bool:
    """Whether a point is the vertex of a corner, as far as can be told."""
    rx, ry, floor = x - m.corners[k, 0], y - m.corners[k, 1], _floor(m, k, tolerance)
    return bool(rx * rx + ry * ry < floor * floor)


@compiled(reassociate=True)
def corner(m: MapArrays, k: int, level: int, x: float, y: float, tolerance: float) -> tuple[Sums, complex]:
    """One corner from a level down, seen from a point not far from it; and a step away from a junction."""
    rx, ry = x - m.corners[k, 0], y - m.corners[k, 1]
    if is_at_vertex(m, k, x, y, tolerance):
        floor = _floor(m, k, tolerance)
        rx, ry = floor * m.corners[k, 6], floor * m.corners[k, 7]
    total, step = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0j
    distance, scale = np.hypot(rx, ry), m.corners[k, 8] * 0.5**level
    while level < LEVELS and distance < 2.0 * scale:
        for place in range(2 * m.corner_index[k, 1]):
            part, away = ring(m, k, level, place, x, y, rx, ry, tolerance)
            step = away if away != 0j else step
            total = add(total, part)
        scale *= 0.5
        level += 1
    return add(total, _tail(m, k, level, rx, ry)), step
