"""An independent solver for harmonic maps: least squares over rational functions with clustered poles.

Real parts of 1 / (z - pole), of powers of z, and for each hole of powers of 1 / (z - inside) fit the boundary
data; none has flux round a hole. The maximum principle bounds the error by the residual on the boundary.
"""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon


class Lightning:
    """T = (u, v) with the boundary angle linear in arc length from the outer ring's first vertex.

    Args:
        region: Polygon, outer ring and holes.
        poles: Poles clustered at each corner.
        degree: Degree of the smooth parts.
    """

    def __init__(self, region: Polygon, *, poles: int = 24, degree: int = 30) -> None:
        region = shapely.orient_polygons(region)
        rings = [np.asarray(r.coords)[:-1] @ [1.0, 1.0j] for r in (region.exterior, *region.interiors)]
        self._centre, self._scale = rings[0].mean(), np.abs(rings[0] - rings[0].mean()).max()
        self._degree = degree
        self._recurrences: dict[int, np.ndarray] = {}
        self._insides = [complex(*Polygon(r).representative_point().coords[0]) for r in region.interiors]
        self._sizes = [np.abs(ring - c).min() for ring, c in zip(rings[1:], self._insides, strict=True)]
        self._poles, self._residues = self._place_poles(rings, poles)
        samples, values, ring_of = self._samples(rings)
        columns = [self._basis(samples).real]
        columns += [-(ring_of == k).astype(float)[:, None] for k in range(1, len(rings))]
        matrix = np.hstack(columns)
        right = np.column_stack((values.real, values.imag))
        scale = np.linalg.norm(matrix, axis=0)
        solution, *_ = np.linalg.lstsq(matrix / scale, right, rcond=1e-14)
        solution /= scale[:, None]
        self.residual = float(np.abs(matrix @ solution - right).max())
        count = matrix.shape[1] - len(rings) + 1
        self._coefficients, self.hole_images = solution[:count], solution[count:]

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """T at points (n, 2)."""
        z = np.asarray(points, dtype=float) @ [1.0, 1.0j]
        return self._basis(z).real @ self._coefficients

    def _place_poles(self, rings: list, poles: int) -> tuple[np.ndarray, np.ndarray]:
        places, sizes = [], []
        for ring in rings:
            out, back = np.roll(ring, -1) - ring, np.roll(ring, 1) - ring
            angle = np.mod(np.angle(back / out), 2 * np.pi)
            away = -out / np.abs(out) * np.exp(0.5j * angle)  # along the exterior bisector
            reach = np.minimum(np.abs(out), np.abs(back))
            roots = np.sqrt(np.arange(1, poles + 1))
            for v, direction, size in zip(ring, away, reach, strict=True):
                distance = 0.5 * size * np.exp(-4.0 * (np.sqrt(poles) - roots))
                places.append(v + direction * distance)
                sizes.append(distance)
        return np.concatenate(places), np.concatenate(sizes)

    def _basis(self, z: np.ndarray) -> np.ndarray:
        """Harmonic functions as real parts; each complex function gives two."""
        parts = [np.ones((len(z), 1)), self._residues / (z[:, None] - self._poles)]
        for k, variable in enumerate(self._variables(z)):
            parts.append(self._orthogonal_powers(k, variable))
        functions = np.hstack(parts)
        return np.hstack((functions, 1j * functions[:, 1:]))

    def _variables(self, z: np.ndarray) -> list[np.ndarray]:
        holes = zip(self._insides, self._sizes, strict=True)
        return [(z - self._centre) / self._scale, *(size / (z - inside) for inside, size in holes)]

    def _orthogonal_powers(self, k: int, s: np.ndarray) -> np.ndarray:
        """Powers 1 to degree of a variable, orthogonal on the first points seen (Arnoldi)."""
        first = k not in self._recurrences
        H = self._recurrences.setdefault(k, np.zeros((self._degree + 1, self._degree), dtype=complex))
        Q = np.ones((len(s), self._degree + 1), dtype=complex)
        for n in range(self._degree):
            q = s * Q[:, n]
            for j in range(n + 1):
                if first:
                    H[j, n] = np.vdot(Q[:, j], q) / len(s)
                q = q - H[j, n] * Q[:, j]
            if first:
                H[n + 1, n] = np.linalg.norm(q) / np.sqrt(len(s))
            Q[:, n + 1] = q / H[n + 1, n]
        return Q[:, 1:]

    def _samples(self, rings: list) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        points, values, owner = [], [], []
        cluster = np.concatenate((np.logspace(-13, -1, 90), np.linspace(0.1, 0.5, 40)[1:]))
        part = np.concatenate((cluster, 1.0 - cluster[:-1]))
        for k, ring in enumerate(rings):
            length = np.abs(np.roll(ring, -1) - ring)
            start = np.concatenate(([0.0], np.cumsum(length)[:-1]))
            for v, w, s, edge in zip(ring, np.roll(ring, -1), start, length, strict=True):
                points.append(v + part * (w - v))
                angle = 2 * np.pi * (s + part * edge) / length.sum()
                values.append(np.exp(1j * angle) if k == 0 else np.zeros(len(part), dtype=complex))
                owner.append(np.full(len(part), k))
        return np.concatenate(points), np.concatenate(values), np.concatenate(owner)
