"""Newton's step towards the quickest motion, from the derivatives of its barrier."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from coop_drake.jit import compiled
from coop_drake.planning.motion_barrier import Slopes
from coop_drake.tree.arrays import FloatArray, IntArray


@compiled
def newton_step(
    slopes: Slopes, places: IntArray, shares: FloatArray, held: NDArray[np.bool_], lengths: FloatArray,
    step: FloatArray,
) -> float:  # fmt: skip
    """Write Newton's step, and return the slope along it.

    p is the change of the control points, l = B p that of log kappa, and n the multipliers of l = B p:
    H p + M' l - B' n = -g and M p + L l + n = -g_l. Where all spans are equally long, p has one more unknown,
    h, the change of that length, which moves the times of all control points.

    The symmetric system is eliminated in the order of the control points. l and n of a cell depend on those
    from its brake's beginning to the cell's end. They are eliminated behind the last of them; h comes last.

    Args:
        slopes: H, g, M, L and g_l.
        places: Columns of B's entries, shape (cells, E).
        shares: B's entries, shape (cells, E).
        held: Which unknowns do not change by themselves, shape (m D,).
        lengths: Change of every unknown with the length of a span, zero where spans are not equal, (m D,).
        step: Receives the step, shape (m D,).
    """
    (n, width), cells = slopes.band.shape, len(places)
    last = 2 * cells  # Place of h among l and n of all cells, which alternate.
    # Rows of l, n and h: by the control points, by themselves, and right sides.
    by_points, corner, ends = (
        np.zeros((last + 1, n + width)),
        np.zeros((last + 1, last + 1)),
        np.zeros(last + 1),
    )
    for j in range(n):
        for k in range(min(width, n - j)):
            by_points[last, j] += slopes.band[j, k] * lengths[j + k]
            if k > 0:
                by_points[last, j + k] += slopes.band[j, k] * lengths[j]
    for j in range(n):
        corner[last, last] += by_points[last, j] * lengths[j]
        ends[last] -= slopes.point[j] * lengths[j]
    if corner[last, last] == 0.0:
        corner[last, last] = 1.0
    begin, end = np.full(cells, n), np.zeros(cells, np.int64)
    for cell in range(cells):
        one, other = 2 * cell, 2 * cell + 1
        corner[one, one], ends[one] = slopes.rates[cell], -slopes.rate[cell]
        corner[one, other] = corner[other, one] = 1.0
        for j in range(n):
            if slopes.mixed[cell, j] != 0.0:
                begin[cell], end[cell] = min(begin[cell], j), j
                by_points[one, j] = slopes.mixed[cell, j]
                corner[one, last] += slopes.mixed[cell, j] * lengths[j]
        for e in range(places.shape[1]):
            j = places[cell, e]
            begin[cell], end[cell] = min(begin[cell], j), max(end[cell], j)
            by_points[other, j] -= shares[cell, e]
            corner[other, last] -= shares[cell, e] * lengths[j]
        for row in (one, other):
            corner[last, row] = corner[row, last]
    for j in range(n):
        if held[j]:
            by_points[:, j] = 0.0
    band, rows, right, sides = (
        np.empty((n + width, width)),
        by_points.copy(),
        np.zeros(n + width),
        ends.copy(),
    )
    whole, damping, active = corner.copy(), 1e-8, np.empty(last + 1, np.int64)
    while True:
        band[n:] = 0.0
        for j in range(n):
            for k in range(width):
                band[j, k] = 0.0 if j + k >= n or held[j] or held[j + k] else slopes.band[j, k]
            band[j, 0] = 1.0 if held[j] else band[j, 0] * (1.0 + damping) + 1e-7
            right[j] = 0.0 if held[j] else -slopes.point[j]
        if _eliminate(band, right, rows, whole, sides, begin, end, active):
            break
        rows[:], whole[:], sides[:], damping = by_points, corner, ends, 100.0 * damping
    # Back from the last unknown to the first; ``sides`` and ``right`` become the unknowns.
    sides[last] /= whole[last, last]
    for j in range(n - 1, -1, -1):
        for cell in range(cells - 1, -1, -1):
            if end[cell] != j:
                continue
            one, other = 2 * cell, 2 * cell + 1
            a, b = (
                sides[one] - whole[one, last] * sides[last],
                sides[other] - whole[other, last] * sides[last],
            )
            for k in range(1, width):
                a -= rows[one, j + k] * right[j + k]
                b -= rows[other, j + k] * right[j + k]
            for c in range(cells):
                if end[c] > j or (end[c] == j and c > cell):
                    for row in (2 * c, 2 * c + 1):
                        a -= whole[one, row] * sides[row]
                        b -= whole[other, row] * sides[row]
            det = whole[one, one] * whole[other, other] - whole[one, other] ** 2
            sides[one] = (whole[other, other] * a - whole[one, other] * b) / det
            sides[other] = (whole[one, one] * b - whole[one, other] * a) / det
        value = right[j] - rows[last, j] * sides[last]
        for k in range(1, width):
            value -= band[j, k] * right[j + k]
        for cell in range(cells):
            if begin[cell] <= j <= end[cell]:
                value -= rows[2 * cell, j] * sides[2 * cell] + rows[2 * cell + 1, j] * sides[2 * cell + 1]
        right[j] = value / band[j, 0]
    slope = 0.0
    for j in range(n):
        step[j] = right[j] + sides[last] * lengths[j]
        slope += slopes.point[j] * step[j]
    for cell in range(cells):
        slope += slopes.rate[cell] * sides[2 * cell]
    return slope


@compiled(borrows=True)
def _eliminate(
    band: FloatArray, right: FloatArray, rows: FloatArray, whole: FloatArray, sides: FloatArray,
    begin: IntArray, end: IntArray, active: IntArray,
) -> bool:  # fmt: skip
    """Eliminate all unknowns but the last one; return whether the pivots have the signs of a minimum.

    Args:
        band: The control points by themselves and the next ones, shape (n + width, width).
        right: Their right sides, shape (n + width,).
        rows: l, n and h by the control points, shape (2 cells + 1, n + width).
        whole: l, n and h by themselves, shape (2 cells + 1, 2 cells + 1).
        sides: Their right sides, shape (2 cells + 1,).
        begin: The first control point's unknown on which l and n of a cell depend, shape (cells,).
        end: The last one, shape (cells,).
        active: Room, shape (2 cells + 1,).
    """
    width, cells, last = band.shape[1], len(begin), len(sides) - 1
    n = len(right) - width
    for j in range(n):
        count, pivot = 1, band[j, 0]
        active[0] = last
        for cell in range(cells):
            if begin[cell] <= j <= end[cell]:
                active[count], active[count + 1] = 2 * cell, 2 * cell + 1
                count += 2
        if not pivot > 0.0:
            return False
        for k in range(1, width):
            factor = band[j, k] / pivot
            if factor != 0.0:
                for m in range(k, width):
                    band[j + k, m - k] -= factor * band[j, m]
                right[j + k] -= factor * right[j]
        for a in range(count):
            row = active[a]
            factor = rows[row, j] / pivot
            if factor == 0.0:
                continue
            for k in range(1, width):
                rows[row, j + k] -= factor * band[j, k]
            sides[row] -= factor * right[j]
            for b in range(count):
                whole[row, active[b]] -= factor * rows[active[b], j]
        for cell in range(cells):
            if end[cell] != j:
                continue
            one, other = 2 * cell, 2 * cell + 1
            p, q, r = whole[one, one], whole[one, other], whole[other, other]
            det = p * r - q * q
            if not det < 0.0:
                return False
            for k in range(1, width):
                a, b = rows[one, j + k], rows[other, j + k]
                if a == 0.0 and b == 0.0:
                    continue
                a, b = (r * a - q * b) / det, (p * b - q * a) / det
                for m in range(k, width):
                    band[j + k, m - k] -= a * rows[one, j + m] + b * rows[other, j + m]
                right[j + k] -= a * sides[one] + b * sides[other]
            for i in range(count):
                row = active[i]
                # l and n of cells that are eliminated, this one included, count no more.
                if row < last and (end[row // 2] < j or (end[row // 2] == j and row // 2 <= cell)):
                    continue
                a, b = whole[row, one], whole[row, other]
                a, b = (r * a - q * b) / det, (p * b - q * a) / det
                for k in range(1, width):
                    rows[row, j + k] -= a * rows[one, j + k] + b * rows[other, j + k]
                sides[row] -= a * sides[one] + b * sides[other]
                for m in range(count):
                    whole[row, active[m]] -= a * whole[one, active[m]] + b * whole[other, active[m]]
    return True
