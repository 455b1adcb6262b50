"""The map and its Jacobian at a point, in machine code.

Far panels are summed directly, near ones through Legendre functions of the second kind, which are exact for
the panel's polynomial density up to the wall itself: with zeta the point in the panel's own coordinate, the
integral of P_k(x) / (x - zeta) over [-1, 1] is -2 Q_k(zeta). Near a corner its dyadic rings are the panels.

All of it stays in this file: compiled code is cached by file, so a caller elsewhere would keep an old callee.
"""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.fields.compiled import compiled
from coop_drake.fields.density import REFINED_NODES
from coop_drake.fields.layers import LEVELS, MapArrays
from coop_drake.fields.quadrature import FloatArray, gauss_nodes

__all__ = ["evaluate_many", "evaluate_one", "velocities_at", "velocity_at"]

_FAR = 2.2**2  # |zeta|^2 beyond which the solved nodes do
_NEAR = 2.9  # |zeta - 1| + |zeta + 1| below which the Legendre functions are needed
_JUNCTION = 1e-6  # the Jacobian is taken no closer than this to where two panels meet, in half panels
_STRAIGHT = 1e-6  # part of the slowdown radius within which the line to a point goal is straight
_GAUSS_X, _GAUSS_W = gauss_nodes(REFINED_NODES)

Sums = tuple[float, float, float, float, float, float]


@compiled
def _direct(s: FloatArray, first: int, last: int, x: float, y: float) -> Sums:
    """Sum over the solved nodes ``first`` to ``last``."""
    tu, tv, xu, yu, xv, yv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(first, last):
        rx, ry = s[0, j] - x, s[1, j] - y
        inverse = 1.0 / (rx * rx + ry * ry)
        rx, ry = rx * inverse, ry * inverse
        re, im = s[2, j] * rx + s[3, j] * ry, s[3, j] * rx - s[2, j] * ry
        re2, im2 = re * rx + im * ry, im * rx - re * ry
        tu += s[4, j] * im
        tv += s[5, j] * im
        xu += s[4, j] * im2
        yu += s[4, j] * re2
        xv += s[5, j] * im2
        yv += s[5, j] * re2
    return tu, tv, xu, yu, xv, yv


@compiled
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


@compiled
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


@compiled
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


@compiled
def _turned(s: Sums, hx: float, hy: float) -> Sums:
    """Divide the derivatives with respect to zeta, given by real and imaginary part, by h."""
    tu, tv, ru, iu, rv, iv = s
    inverse = 1.0 / (hx * hx + hy * hy)
    hx, hy = hx * inverse, hy * inverse
    return tu, tv, iu * hx - ru * hy, ru * hx + iu * hy, iv * hx - rv * hy, rv * hx + iv * hy


@compiled
def _away(ax: float, ay: float, bx: float, by: float) -> complex:
    """A step off the wall if the point, seen from which the panel runs from a to b, is at one of its ends."""
    hx, hy = 0.5 * (bx - ax), 0.5 * (by - ay)
    nearest = min(ax * ax + ay * ay, bx * bx + by * by)
    if nearest < _JUNCTION * _JUNCTION * (hx * hx + hy * hy):
        return complex(-hy, hx) * (2.0 * _JUNCTION)
    return 0j


@compiled
def _add(a: Sums, b: Sums) -> Sums:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@compiled
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


@compiled
def _corner(m: MapArrays, k: int, x: float, y: float, tolerance: float) -> tuple[Sums, complex]:
    """One corner seen from a point not far from it; and a step away from a junction of panels."""
    rx, ry = x - m.corners[k, 0], y - m.corners[k, 1]
    floor = max(2.0 * m.corners[k, 8] * 0.5**LEVELS, 4.0 * tolerance)
    if rx * rx + ry * ry < floor * floor:
        rx, ry = floor * m.corners[k, 6], floor * m.corners[k, 7]
    total, step = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0j
    panels, first_break, first = m.corner_index[k, 1], m.corner_index[k, 4], m.corner_index[k, 5]
    scale, level = m.corners[k, 8], 0
    while level < LEVELS and np.hypot(rx, ry) < 2.0 * scale:
        for leg in range(2):
            dx, dy = scale * m.corners[k, 2 + 2 * leg], scale * m.corners[k, 3 + 2 * leg]
            for j in range(panels):
                a, b = m.breaks[first_break + j], m.breaks[first_break + j + 1]
                ax, ay, bx, by = a * dx - rx, a * dy - ry, b * dx - rx, b * dy - ry
                if level == 0 and j == panels - 1:
                    bx, by = m.corners[k, 9 + 2 * leg] - x, m.corners[k, 10 + 2 * leg] - y
                if leg == 0:
                    ax, ay, bx, by = bx, by, ax, ay
                away = _away(ax, ay, bx, by)
                step = away if away != 0j else step
                ring = m.rings[first + (2 * level + leg) * panels + j]
                total = _add(total, _panel(ring, ax, ay, bx, by, tolerance))
        scale *= 0.5
        level += 1
    return _add(total, _tail(m, k, level, rx, ry)), step


@compiled
def _sums(m: MapArrays, x: float, y: float, tolerance: float) -> tuple[Sums, complex]:
    """Sum over the whole boundary; and a step away from a junction of panels, if one is at hand."""
    total, step = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0j
    corners = len(m.corners)
    for k in range(corners):
        rx, ry, leg = x - m.corners[k, 0], y - m.corners[k, 1], m.corners[k, 8]
        if rx * rx + ry * ry >= 4.0 * leg * leg:
            part = _direct(m.sources, m.corner_index[k, 0], m.corner_index[k + 1, 0], x, y)
        else:
            part, away = _corner(m, k, x, y, tolerance)
            step = away if away != 0j else step
        total = _add(total, part)
    first = m.corner_index[corners, 0]
    nodes = (m.sources.shape[1] - first) // max(len(m.panels), 1)
    for k in range(len(m.panels)):
        ax, ay = m.panels[k, 0] - x, m.panels[k, 1] - y
        bx, by = m.panels[k, 2] - x, m.panels[k, 3] - y
        middle_squared = (ax + bx) ** 2 + (ay + by) ** 2
        if middle_squared >= _FAR * ((bx - ax) ** 2 + (by - ay) ** 2):
            part = _direct(m.sources, first + k * nodes, first + (k + 1) * nodes, x, y)
        else:
            away = _away(ax, ay, bx, by)
            step = away if away != 0j else step
            part = _panel(m.panel_density[k], ax, ay, bx, by, tolerance)
        total = _add(total, part)
    return total, step


@compiled
def is_inside(edges: FloatArray, x: float, y: float) -> bool:
    """Whether a point is inside by the crossing number of all rings."""
    inside = False
    for e in range(len(edges)):
        y0, y1 = edges[e, 1], edges[e, 3]
        if (y0 > y) != (y1 > y):
            side = (edges[e, 2] - edges[e, 0]) * (y - y0) - (x - edges[e, 0]) * (y1 - y0)
            if (side > 0.0) == (y1 > y0):
                inside = not inside
    return inside


@compiled
def nearest_on_edges(edges: FloatArray, x: float, y: float) -> tuple[float, float]:
    """The nearest point of the boundary."""
    best, bx, by = np.inf, x, y
    for e in range(len(edges)):
        dx, dy = edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1]
        squared = dx * dx + dy * dy
        t = ((x - edges[e, 0]) * dx + (y - edges[e, 1]) * dy) / squared if squared > 0.0 else 0.0
        t = min(1.0, max(0.0, t))
        px, py = edges[e, 0] + t * dx, edges[e, 1] + t * dy
        distance = (px - x) ** 2 + (py - y) ** 2
        if distance < best:
            best, bx, by = distance, px, py
    return bx, by


@compiled
def evaluate_one(m: MapArrays, x: float, y: float, tolerance: float) -> Sums:
    """u, v, u_x, u_y, v_x, v_y at a point relative to the map's centre; outside: at the nearest wall.

    Behind a wall by less than ``tolerance``, the rounding of the coordinates [m], counts as on it.
    """
    if not is_inside(m.edges, x, y):
        x, y = nearest_on_edges(m.edges, x, y)
    total, step = _sums(m, x, y, tolerance)
    tu, tv, xu, yu, xv, yv = total
    if step != 0j:
        _, _, xu, yu, xv, yv = _sums(m, x + step.real, y + step.imag, tolerance)[0]
    c = 0.5 / pi
    return c * tu, c * tv, c * xu, c * yu, c * xv, c * yv


@compiled
def evaluate_many(m: MapArrays, points: FloatArray, tolerance: float) -> tuple[FloatArray, FloatArray]:
    """Images (n, 2) and Jacobians (n, 2, 2) of points (n, 2) relative to the map's centre."""
    images, jacobians = np.empty((len(points), 2)), np.empty((len(points), 2, 2))
    for i in range(len(points)):
        values = evaluate_one(m, points[i, 0], points[i, 1], tolerance)
        for k in range(2):
            images[i, k] = values[k]
            jacobians[i, 0, k], jacobians[i, 1, k] = values[2 + k], values[4 + k]
    return images, jacobians


@compiled
def velocity_at(
    arrays: MapArrays, x: float, y: float, rounding: float,
    goal: FloatArray, image: FloatArray, radius: float, max_speed: float,
) -> FloatArray:  # fmt: skip
    """Direction times speed at a point relative to the map's centre."""
    velocity = np.zeros(2)
    gx, gy = nearest_on_edges(goal, x, y)
    remaining = np.hypot(gx - x, gy - y)
    if remaining == 0.0 or is_inside(goal, x, y):
        return velocity
    if len(goal) == 1 and remaining < _STRAIGHT * radius:
        dx, dy = gx - x, gy - y
    else:
        u, v, u_x, u_y, v_x, v_y = evaluate_one(arrays, x, y, rounding)
        du, dv = image[0] - u, image[1] - v
        dx, dy = v_y * du - u_y * dv, u_x * dv - v_x * du
    norm = np.hypot(dx, dy)
    if norm > 0.0:
        speed = max_speed * min(1.0, remaining / radius)
        velocity[0], velocity[1] = speed * dx / norm, speed * dy / norm
    return velocity


@compiled
def velocities_at(
    arrays: MapArrays, points: FloatArray, rounding: float,
    goal: FloatArray, image: FloatArray, radius: float, max_speed: float,
) -> FloatArray:  # fmt: skip
    """The same at many points (n, 2)."""
    velocities = np.empty((len(points), 2))
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        velocities[i] = velocity_at(arrays, x, y, rounding, goal, image, radius, max_speed)
    return velocities
