"""The barrier of the quickest motion: minus the sum of the logarithms of what is left of every limit.

Velocities and accelerations are limited at the knots, positions and axes by the Bezier points of every span.
"""

from __future__ import annotations

from math import log
from typing import NamedTuple

import numpy as np

from coop_drake.geometry.polygons import nearest_fraction
from coop_drake.jit import compiled
from coop_drake.laws.governor import Value
from coop_drake.planning.motion_limits import Chains, follow
from coop_drake.tree.arrays import FloatArray, IntArray

BRAKES = 6
"""Largest number of cells in which the team may have to brake at one knot [-]."""

HALF_PLANES = 16
"""Largest number of half-planes that hold one piece [-]."""

BEZIER = np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6.0
"""The Bezier points of a span by its control points, shape (4, 4) [-]."""

KNOT = np.array([1.0, 4.0, 1.0]) / 6.0
"""A spline at a knot, by three control points, shape (3,) [-]."""


class Course(NamedTuple):
    """What the barrier needs to know beside the control points.

    Attributes:
        chains: The bases.
        limits: Largest velocity, acceleration and jerk of every point of ``follow``, shape (P, 3). Jerk is
            limited where spans are equal: the difference of accelerations at consecutive knots.
        spans: The span of every piece, shape (pieces,).
        shares: The Bezier points of every piece by the control points of its span, shape (pieces, 4, 4).
        lower: Lower ends of (theta, q...) of every piece, shape (pieces, 1 + n).
        upper: Upper ends.
        planes: Half-planes n . p >= c that hold a piece's positions, shape (pieces, ``HALF_PLANES``, 3).
        counts: How many there are, shape (pieces,).
    """

    chains: Chains
    limits: FloatArray
    spans: IntArray
    shares: FloatArray
    lower: FloatArray
    upper: FloatArray
    planes: FloatArray
    counts: IntArray


class Slopes(NamedTuple):
    """Derivatives of the barrier by the control points (z, t), D = 4 + n, m points, and by log kappa.

    Attributes:
        band: Second derivatives by an unknown and itself or one of the next ones, shape (m D, 4 D).
        point: First derivatives, shape (m D,).
        mixed: Second derivatives by log kappa and the control points, shape (cells, m D).
        rates: Second derivatives by log kappa of one cell, shape (cells,); those of two cells are zero.
        rate: First derivatives by log kappa, shape (cells,).
    """

    band: FloatArray
    point: FloatArray
    mixed: FloatArray
    rates: FloatArray
    rate: FloatArray


# How quickly the team brakes.


@compiled(borrows=True)
def brake(
    points: FloatArray, windows: FloatArray, waiting: float, ramp: float, kappa: FloatArray, acting: IntArray
) -> bool:
    """Write kappa of every cell but the last, and where it may act; return whether cells last long enough.

    Args:
        points: Control points (z, t), shape (m, D).
        windows: u at which the motion enters every cell and at which it leaves it, shape (cells, 2).
        waiting: 2 W, from tau_i to beta_i [s].
        ramp: r [s].
        kappa: Receives the rates, shape (cells,) [1/s].
        acting: See ``barrier``; receives cells.
    """
    m, T = points.shape[0], points.shape[1] - 1
    before = -np.inf
    for j in range(m):
        acting[j, 0] = 0
    for cell in range(len(windows) - 1):
        tau = x = 0.0
        begin, end = int(windows[cell, 0]), int(windows[cell, 1])
        for e in range(4):
            tau += time_shares(windows[cell, 0] - begin)[e] * points[min(begin + e, m - 1), T]
            x += time_shares(windows[cell, 1] - end)[e] * points[min(end + e, m - 1), T]
        left = 2.0 * (x - tau - waiting) - ramp
        if not left > 0.0:
            return False
        kappa[cell] = 1.0 / left
        for j in range(1, min(int(windows[cell, 1]) + 3, m - 1)):
            if points[j + 1, T] >= before:
                if acting[j, 0] == BRAKES:
                    return False
                acting[j, 0] += 1
                acting[j, acting[j, 0]] = cell
        before = tau + waiting
    return True


@compiled(inlined=True)
def time_shares(s: Value) -> tuple[Value, Value, Value, Value]:
    """Return by which shares of its control points t is found at s from 0 to 1 in a span, taken linear there.

    Where spans are equal, it is.
    """
    return (1.0 - s) / 6.0, (4.0 - 3.0 * s) / 6.0, (1.0 + 3.0 * s) / 6.0, s / 6.0


# The barrier.


@compiled
def barrier(
    points: FloatArray, weight: float, course: Course, kappa: FloatArray, acting: IntArray, slopes: Slopes,
    derive: bool,
) -> float:  # fmt: skip
    """Return the barrier of limits at all knots, infinite where one is not kept, and add its derivatives.

    Args:
        points: Control points (z, t), shape (m, D).
        weight: Weight of the barrier [s].
        course: Limits and cells.
        kappa: Largest -rho' for every cell, shape (cells,) [1/s].
        acting: Of every control point how many cells may make the team brake at its knot, and which, shape
            (m, 1 + ``BRAKES``).
        slopes: Receives the derivatives.
        derive: Whether they are wanted.
    """
    m, D = points.shape
    d, P = D - 1, len(course.limits)
    total = 0.0
    x, v, a = np.empty(d), np.empty(d), np.empty(d)
    moved, by, y = np.empty((2, 2)), np.empty((4, 2, d)), np.empty(2)
    # Rows of V and A by the control points; their products with the second derivatives by V, A and log kappa.
    rows, after, places = np.empty((4, 3 * D)), np.empty((4 + BRAKES, 3 * D)), np.empty(3 * D, np.int64)
    first, second = np.empty(4 + BRAKES), np.empty((4 + BRAKES, 4 + BRAKES))
    # A at the knot before and its rows, by the four control points of the span between.
    last, slopes_before, jerks = np.zeros((P, 2)), np.zeros((P, 2, 4 * D)), np.empty((2, 4 * D))
    for j in range(1, m - 1):
        before, behind = points[j - 1], points[j + 1]
        t_u, t_uu = 0.5 * (behind[d] - before[d]), before[d] - 2.0 * points[j, d] + behind[d]
        if not t_u > 0.0:
            return np.inf
        for k in range(d):
            x[k] = (before[k] + 4.0 * points[j, k] + behind[k]) / 6.0
            v[k] = 0.5 * (behind[k] - before[k]) / t_u
            a[k] = (before[k] - 2.0 * points[j, k] + behind[k] - v[k] * t_uu) / (t_u * t_u)
        acts = acting[j, 0]
        for point in range(P):
            if not course.limits[point].min() < np.inf:
                continue
            size = follow(course.chains, point, x, v, a, moved, by, derive)
            if derive:
                first[:], second[:] = 0.0, 0.0
            lefts = 1.0  # Their product: one logarithm is quicker than many.
            # The velocity; then s A - kappa V with (s, kappa) = (1, 0), and (1, kappa), (0, kappa) for cells.
            for case in range(2 + 2 * acts):
                limit = course.limits[point, min(case, 1)]
                if not limit < np.inf:
                    continue
                which, of_v, of_a = -1, 1.0 - min(case, 1), float(case % 2)
                if case > 1:
                    which = (case - 2) // 2
                    of_v = -kappa[acting[j, 1 + which]]
                square = 0.0
                for i in range(size):
                    y[i] = of_a * moved[1, i] + of_v * moved[0, i]
                    square += y[i] * y[i]
                share = 1.0 / (limit * limit)
                left = 1.0 - share * square
                if not left > 0.0:
                    return np.inf
                lefts *= left
                if not derive:
                    continue
                force = 2.0 * share * weight / left
                for i in range(size):
                    # y's derivatives by V_i, A_i and log kappa are of_v, of_a and of_v V_i.
                    push = force * y[i]
                    first[i] += push * of_v
                    first[2 + i] += push * of_a
                    if which >= 0:
                        first[4 + which] += push * of_v * moved[0, i]
                    for k in range(i + 1):
                        bend = push * 2.0 * share / left * y[k] + (force if i == k else 0.0)
                        second[i, k] += bend * of_v * of_v
                        second[2 + i, k] += bend * of_a * of_v
                        if k < i:
                            second[2 + k, i] += bend * of_a * of_v
                        second[2 + i, 2 + k] += bend * of_a * of_a
                        if which >= 0:
                            q = 4 + which
                            second[q, k] += bend * of_v * moved[0, i] * of_v
                            second[q, 2 + k] += bend * of_v * moved[0, i] * of_a
                            if k < i:
                                second[q, i] += bend * of_v * moved[0, k] * of_v
                                second[q, 2 + i] += bend * of_v * moved[0, k] * of_a
                            second[q, q] += (
                                (1.0 if k == i else 2.0) * bend * of_v * of_v * moved[0, i] * moved[0, k]
                            )
            jerk = course.limits[point, 2]
            if jerk < np.inf and j > 1:
                square = 0.0
                for i in range(size):
                    y[i] = (moved[1, i] - last[point, i]) / t_u
                    square += y[i] * y[i]
                left = 1.0 - square / (jerk * jerk)
                if not left > 0.0:
                    return np.inf
                lefts *= left
            total -= weight * log(lefts)
            for i in range(size):
                last[point, i] = moved[1, i]
            if not derive:
                continue
            second[0, 1], second[2, 3] = second[1, 0], second[3, 2]
            for i in range(2):
                for k in range(2):
                    second[i, 2 + k] = second[2 + k, i]
            count = 0
            for e in range(3):
                value, slope, curve = KNOT[e], 0.5 * (e - 1), 1.0 - 3.0 * (e == 1)
                slope, bent = slope / t_u, (curve - slope / t_u * t_uu) / (t_u * t_u)
                for k in range(D):
                    if k < d and by[1, 0, k] == 0.0 and (size == 1 or by[1, 1, k] == 0.0):
                        continue
                    places[count] = e * D + k
                    for i in range(size):
                        if k < d:
                            rows[i, count] = by[0, i, k] * value + by[1, i, k] * slope
                            rows[2 + i, count] = (
                                by[2, i, k] * value + by[3, i, k] * slope + by[1, i, k] * bent
                            )
                        else:
                            to_v = to_a = 0.0
                            for c in range(d):
                                to_v -= by[1, i, c] * v[c]
                                to_a -= by[3, i, c] * v[c] * slope
                                to_a += by[1, i, c] * (-v[c] * bent - 2.0 * a[c] * slope)
                            rows[i, count], rows[2 + i, count] = to_v * slope, to_a
                    count += 1
            begin = (j - 1) * D
            if jerk < np.inf:
                if j > 1:
                    _add_jerk(
                        weight,
                        jerk,
                        t_u,
                        y,
                        size,
                        rows,
                        places[:count],
                        slopes_before[point],
                        jerks,
                        begin - D,
                        slopes,
                    )
                slopes_before[point] = 0.0
                for c in range(count):
                    for i in range(size):
                        slopes_before[point, i, places[c]] = rows[2 + i, c]
            for p in range(4 + acts):
                if p < 4 and p % 2 >= size:
                    continue
                for c in range(count):
                    after[p, c] = 0.0
                for q in range(4):
                    if q % 2 < size:
                        for c in range(count):
                            after[p, c] += second[p, q] * rows[q, c]
            for p in range(4):
                if p % 2 >= size:
                    continue
                for c in range(count):
                    slopes.point[begin + places[c]] += first[p] * rows[p, c]
                    for e in range(c + 1):
                        slopes.band[begin + places[e], places[c] - places[e]] += rows[p, c] * after[p, e]
            for p in range(acts):
                cell = acting[j, 1 + p]
                slopes.rate[cell] += first[4 + p]
                slopes.rates[cell] += second[4 + p, 4 + p]
                for c in range(count):
                    slopes.mixed[cell, begin + places[c]] += after[4 + p, c]
    return total + _add_cells(points, weight, course, slopes, derive)


@compiled(borrows=True)
def _add_jerk(
    weight: float, limit: float, t_u: float, y: FloatArray, size: int, rows: FloatArray, places: IntArray,
    before: FloatArray, jerks: FloatArray, begin: int, slopes: Slopes,
) -> None:  # fmt: skip
    """Add the derivatives of -weight log(1 - |y|^2 / limit^2), y = (A_j - A_(j-1)) / t_u, spans being equal.

    Args:
        weight: Of the barrier.
        limit: Of |y|.
        t_u: Time of a span [s].
        y: The jerk, shape (2,).
        size: Of how many numbers it consists.
        rows: From its third row on, derivatives of A_j.
        places: Their columns, from the second control point of the span on.
        before: Derivatives of A_(j-1) by the four control points, shape (2, 4 D).
        jerks: Room, shape (2, 4 D).
        begin: Column of the span's first control point.
        slopes: Receives the derivatives.
    """
    count = before.shape[1]
    D = count // 4
    share, square = 1.0 / (limit * limit), 0.0
    for i in range(size):
        square += y[i] * y[i]
        for k in range(count):
            jerks[i, k] = -before[i, k] / t_u
        for c in range(places.size):
            jerks[i, D + places[c]] += rows[2 + i, c] / t_u
        jerks[i, 2 * D - 1] += 0.5 * y[i] / t_u
        jerks[i, 4 * D - 1] -= 0.5 * y[i] / t_u
    left = 1.0 - share * square
    force = 2.0 * share * weight / left
    for k in range(count):
        along = across = 0.0
        for i in range(size):
            along += y[i] * jerks[i, k]
        if along == 0.0 and jerks[0, k] == 0.0 and (size == 1 or jerks[1, k] == 0.0):
            continue
        slopes.point[begin + k] += force * along
        for m in range(k + 1):
            across = value = 0.0
            for i in range(size):
                across += y[i] * jerks[i, m]
                value += jerks[i, k] * jerks[i, m]
            slopes.band[begin + m, k - m] += force * (value + 2.0 * share / left * along * across)


@compiled(borrows=True)
def add_times(
    points: FloatArray, weight: float, shortest: FloatArray, evenness: float, slopes: Slopes, derive: bool
) -> float:
    """Return the barrier of the times between control points; add its derivatives.

    Args:
        points: Control points (z, t), shape (m, D).
        weight: Weight of the barrier [s].
        shortest: Shortest times, shape (m - 1,) [s].
        evenness: Largest ratio of neighbouring times [-].
        slopes: Receives the derivatives.
        derive: Whether they are wanted.
    """
    m, D = points.shape
    total = 0.0
    for j in range(1, m - 1):
        before, after = points[j, D - 1] - points[j - 1, D - 1], points[j + 1, D - 1] - points[j, D - 1]
        for case in range(4):
            if case == 0:
                left, shares = before - shortest[j - 1], (-1.0, 1.0, 0.0)
            elif case == 1:
                left, shares = after - shortest[j], (0.0, -1.0, 1.0)
            elif case == 2:
                left, shares = evenness * before - after, (-evenness, evenness + 1.0, -1.0)
            else:
                left, shares = evenness * after - before, (1.0, -evenness - 1.0, evenness)
            if not left > 0.0:
                return np.inf
            total -= weight * log(left)
            for i in range(3 if derive else 0):
                slopes.point[(j + i) * D - 1] -= weight / left * shares[i]
                for k in range(i + 1):
                    bend = weight / (left * left) * shares[i] * shares[k]
                    slopes.band[(j + k) * D - 1, (i - k) * D] += bend
    return total


@compiled(borrows=True)
def _add_cells(points: FloatArray, weight: float, course: Course, slopes: Slopes, derive: bool) -> float:
    """Return the barrier of boxes and half-planes, and add its derivatives."""
    D = points.shape[1]
    d, total = D - 1, 0.0
    for piece in range(course.spans.size):
        span, shares = course.spans[piece], course.shares[piece]
        for b in range(4):
            lefts = 1.0
            for k in range(2, d):
                low, high, value = course.lower[piece, k - 2], course.upper[piece, k - 2], 0.0
                for e in range(4):
                    value += shares[b, e] * points[span + e, k]
                if not (low < value < high):
                    return np.inf
                below, above = value - low, high - value
                lefts *= below * above / (high - low) ** 2
                if derive:
                    first, second = weight / above - weight / below, weight / above**2 + weight / below**2
                    for e in range(4):
                        slopes.point[(span + e) * D + k] += first * shares[b, e]
                        for i in range(e + 1):
                            value = second * shares[b, e] * shares[b, i]
                            slopes.band[(span + i) * D + k, (e - i) * D] += value
            px = py = 0.0
            for e in range(4):
                px += shares[b, e] * points[span + e, 0]
                py += shares[b, e] * points[span + e, 1]
            gx = gy = xx = xy = yy = 0.0
            for f in range(course.counts[piece]):
                nx, ny = course.planes[piece, f, 0], course.planes[piece, f, 1]
                left = nx * px + ny * py - course.planes[piece, f, 2]
                if not left > 0.0:
                    return np.inf
                lefts *= left
                if not derive:
                    continue
                first, second = weight / left, weight / (left * left)
                gx, gy = gx - first * nx, gy - first * ny
                xx, xy, yy = xx + second * nx * nx, xy + second * nx * ny, yy + second * ny * ny
            total -= weight * log(lefts)
            if derive:
                for e in range(4):
                    slopes.point[(span + e) * D] += gx * shares[b, e]
                    slopes.point[(span + e) * D + 1] += gy * shares[b, e]
                    for i in range(e + 1):
                        share, place, below_it = shares[b, e] * shares[b, i], (span + i) * D, (e - i) * D
                        slopes.band[place, below_it] += xx * share
                        slopes.band[place + 1, below_it] += yy * share
                        slopes.band[place, below_it + 1] += xy * share
                        if i < e:
                            slopes.band[place + 1, below_it - 1] += xy * share
    return total


# Half-planes that hold a piece's positions and cut off every edge of its cells' regions.


@compiled
def lay_planes(
    hulls: FloatArray, cells: IntArray, edges: FloatArray, first: IntArray, margin: float, planes: FloatArray,
    counts: IntArray,
) -> float:  # fmt: skip
    """Write half-planes of all pieces.

    Args:
        hulls: The Bezier points of every piece's positions, shape (pieces, 4, 2) [m].
        cells: First and last cell of every piece, shape (pieces, 2).
        edges: Edges of the regions of all cells, shape (E, 4) [m].
        first: First edge of every cell and the edge after the last one, shape (cells + 1,).
        margin: Distance that they keep to the edges, or nine tenths of a smaller one [m].
        planes: Receives n and c of half-planes n . p >= c, shape (pieces, ``HALF_PLANES``, 3).
        counts: Receives their numbers.

    Returns:
        The least distance of a piece's hull from an edge, zero where it meets one [m].
    """
    least = np.inf
    for piece in range(len(cells)):
        ring = hulls[piece]
        begin, end = first[cells[piece, 0]], first[cells[piece, 1] + 1]
        near, away = np.empty((end - begin, 4)), np.empty(end - begin)
        for k in range(end - begin):
            ax, ay, bx, by = edges[begin + k]
            away[k] = np.inf
            for b in range(4):
                s = nearest_fraction(ring[b, 0], ring[b, 1], ax, ay, bx, by)
                qx, qy = ax + s * (bx - ax), ay + s * (by - ay)
                square = (ring[b, 0] - qx) ** 2 + (ring[b, 1] - qy) ** 2
                if square < away[k]:
                    away[k], near[k] = square, np.array([qx, qy, ring[b, 0], ring[b, 1]])
                for i in range(b):
                    for corner in range(2):
                        qx, qy = edges[begin + k, 2 * corner], edges[begin + k, 2 * corner + 1]
                        s = nearest_fraction(qx, qy, ring[i, 0], ring[i, 1], ring[b, 0], ring[b, 1])
                        px = ring[i, 0] + s * (ring[b, 0] - ring[i, 0])
                        py = ring[i, 1] + s * (ring[b, 1] - ring[i, 1])
                        square = (px - qx) ** 2 + (py - qy) ** 2
                        if square < away[k]:
                            away[k], near[k] = square, np.array([qx, qy, px, py])
        counts[piece] = 0
        for k in np.argsort(away):
            qx, qy, px, py = near[k]
            cut = counts[piece] == HALF_PLANES
            for f in range(counts[piece]):
                nx, ny, c = planes[piece, f]
                ends = edges[begin + k]
                cut = cut or max(nx * ends[0] + ny * ends[1], nx * ends[2] + ny * ends[3]) <= c
            if cut:
                continue
            length = np.sqrt(away[k])
            least = min(least, length)
            if length == 0.0:
                return 0.0
            nx, ny = (px - qx) / length, (py - qy) / length
            kept = margin if length > margin else 0.9 * length
            planes[piece, counts[piece]] = np.array([nx, ny, nx * qx + ny * qy + kept])
            counts[piece] += 1
    return least
