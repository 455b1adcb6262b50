"""An independent solver for harmonic maps of polygons: a single layer of constant, graded elements.

With a real density s for each of u and v,

    u(z) = oint s(t) log|z - t| |dt| + a,    oint over every ring of s |dt| = 0,

is harmonic and without flux round holes; the constant a makes every scale solvable. Collocation at the middle
of each element asks for the boundary angle on the outer ring and an unknown constant on each hole.
"""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry


class SingleLayer:
    """T = (u, v) with the boundary angle linear in arc length from the outer ring's first vertex.

    Args:
        region: Polygon, outer ring and holes.
        elements: Elements on an edge of mean length; others get as the root of theirs.
        grading: Power of the grading towards both ends of an edge.
        collapsed: Shape whose boundary on the outer ring gets no angle.
    """

    def __init__(
        self,
        region: Polygon,
        *,
        elements: int = 40,
        grading: float = 2.5,
        collapsed: BaseGeometry | None = None,
    ) -> None:
        region = shapely.orient_polygons(region)
        rings = [np.asarray(r.coords)[:-1] @ [1.0, 1.0j] for r in (region.exterior, *region.interiors)]
        mean = np.mean(np.concatenate([np.abs(np.roll(ring, -1) - ring) for ring in rings]))
        starts, ends, values, ring_of = [], [], [], []
        for k, ring in enumerate(rings):
            a, b, value = _elements(ring, elements / np.sqrt(mean), grading, collapsed if k == 0 else None)
            starts.append(a)
            ends.append(b)
            values.append(np.exp(1j * value) if k == 0 else np.zeros(len(a), dtype=complex))
            ring_of.append(np.full(len(a), k))
        self._start, self._end = np.concatenate(starts), np.concatenate(ends)
        self._solve(np.concatenate(values), np.concatenate(ring_of), len(rings))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """T at points (n, 2)."""
        z = np.asarray(points, dtype=float) @ [1.0, 1.0j]
        return self._potentials(z) @ self._density + self._constant

    def jacobian(self, points: np.ndarray) -> np.ndarray:
        """dT/dp at points (n, 2), shape (n, 2, 2)."""
        z = (np.asarray(points, dtype=float) @ [1.0, 1.0j])[:, None]
        direction = (self._end - self._start) / np.abs(self._end - self._start)
        # d/dz of the integral of log(z - t) |dt|; u_x - i u_y is that of the potential.
        slope = np.conj(direction) * (np.log((z - self._start) / (z - self._end)))
        derivative = slope @ self._density
        return np.stack((derivative.real, -derivative.imag), axis=-1)

    def _potentials(self, z: np.ndarray) -> np.ndarray:
        """Integral of log|z - t| |dt| over each element, shape (points, elements)."""
        span = self._end - self._start
        length = np.abs(span)
        w = (z[:, None] - self._start) * np.conj(span) / length
        with np.errstate(divide="ignore", invalid="ignore"):
            from_start = np.where(w == 0, 0.0, (w * np.log(w)).real)
            from_end = np.where(w == length, 0.0, ((w - length) * np.log(w - length)).real)
        return from_start - from_end - length

    def _solve(self, values: np.ndarray, ring_of: np.ndarray, rings: int) -> None:
        n, length = len(values), np.abs(self._end - self._start)
        matrix = np.zeros((n + rings, n + rings))
        matrix[:n, :n] = self._potentials(0.5 * (self._start + self._end))
        matrix[:n, n] = 1.0  # the constant a
        for k in range(rings):
            matrix[n + k, :n][ring_of == k] = length[ring_of == k]
        # On hole k the value is c_k: u - c_k = 0.
        holes = np.flatnonzero(ring_of > 0)
        matrix[holes, n + ring_of[holes]] = -1.0
        right = np.zeros((n + rings, 2))
        right[:n] = np.column_stack((values.real, values.imag))
        solution = np.linalg.solve(matrix, right)
        self._density, self._constant = solution[:n], solution[n]
        self.hole_images = solution[n + 1 :]


def _elements(
    ring: np.ndarray, density: float, grading: float, collapsed: BaseGeometry | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of the elements of a ring and the boundary angle at their middles."""
    following = np.roll(ring, -1)
    lengths = np.abs(following - ring)
    spans = lengths.copy()
    if collapsed is not None:
        middles = 0.5 * (ring + following)
        spans[shapely.distance(collapsed, shapely.points(middles.real, middles.imag)) < 1e-9] = 0.0
    before = np.concatenate(([0.0], np.cumsum(spans)[:-1]))
    starts, ends, angles = [], [], []
    for a, b, length, span, first in zip(ring, following, lengths, spans, before, strict=True):
        n = int(np.ceil(0.5 * density * np.sqrt(length)))
        near = 0.5 * (np.arange(n + 1) / n) ** grading
        part = np.concatenate((near, 1.0 - near[-2::-1]))
        starts.append(a + part[:-1] * (b - a))
        ends.append(a + part[1:] * (b - a))
        angles.append((first + 0.5 * (part[1:] + part[:-1]) * span) * 2.0 * np.pi / spans.sum())
    return np.concatenate(starts), np.concatenate(ends), np.concatenate(angles)
