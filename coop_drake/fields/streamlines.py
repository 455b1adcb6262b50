"""Streamlines of a velocity field, many at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from coop_drake.fields.points import as_points
from coop_drake.fields.quadrature import FloatArray
from coop_drake.fields.velocity_field import VelocityField
from coop_drake.geometry.boundary import BoundaryDistance

__all__ = ["Streamlines", "trace_streamlines"]

_STEP = 0.3  # of the distance to the walls, or to the goal if that is less
_SHORTEST_STEP = 1e-5  # of the region's size, for starts on a wall
_ARRIVED = 0.01  # of the radius of slowing down


@dataclass(frozen=True)
class Streamlines:
    """Where the points of a field go.

    Attributes:
        paths: For each start its streamline, shape (points, 2) [m].
        times: When each comes within a hundredth of the radius of slowing down of the goal, infinite where
            it does not, shape (n,) [s].
    """

    paths: tuple[FloatArray, ...]
    times: FloatArray

    @property
    def arrived(self) -> NDArray[np.bool_]:
        """Whether each start arrives, shape (n,)."""
        return np.isfinite(self.times)


def trace_streamlines(field: VelocityField, starts: ArrayLike, *, max_steps: int = 2_000) -> Streamlines:
    """Follow a field from many starts by Heun's rule, with steps that shorten near walls.

    Args:
        field: The field.
        starts: Points in the map's region, shape (n, 2) [m].
        max_steps: Steps after which a streamline counts as lost.

    Raises:
        FieldError: If the starts have another shape or are not finite.
    """
    here = as_points(starts).reshape(-1, 2).copy()
    region, goal = field.harmonic_map.region, field.harmonic_map.goal
    clearance = BoundaryDistance(region)
    shortest = _SHORTEST_STEP * float(np.hypot(*np.subtract(region.bounds[2:], region.bounds[:2])))
    close = _ARRIVED * field.slowdown_radius
    times, going = np.zeros(len(here)), np.ones(len(here), dtype=bool)
    history, followed = [here.copy()], [going.copy()]
    shapely.prepare(goal)
    for _ in range(max_steps):
        remaining = np.asarray(shapely.distance(goal, shapely.points(here)))
        going = going & (remaining > close)
        if not going.any():
            break
        p, left = here[going], remaining[going]
        room = np.maximum(clearance.batch(p), 0.0)
        step = np.minimum(
            _STEP * room + shortest, np.where(left > 2.0 * close, 0.5 * left, left - 0.99 * close)
        )
        first = field(p)
        second = field(p + step[:, None] * _unit(first))
        here[going] = p + 0.5 * step[:, None] * (_unit(first) + _unit(second))
        times[going] += step * _slowness(first, second)
        history.append(here.copy())
        followed.append(going)
    times[going] = np.inf
    visited, on_way = np.array(history), np.array(followed)
    return Streamlines(tuple(visited[on_way[:, k], k] for k in range(len(here))), times)


def _unit(vectors: FloatArray) -> FloatArray:
    """Directions of vectors (n, 2); zero stays zero."""
    lengths = np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    return np.asarray(vectors / lengths)


def _slowness(first: FloatArray, second: FloatArray) -> FloatArray:
    """Mean of 1 / speed between two points by Simpson's rule (n,) [s/m]."""
    before, after = (np.maximum(np.linalg.norm(v, axis=1), 1e-300) for v in (first, second))
    return np.asarray((1.0 / before + 8.0 / (before + after) + 1.0 / after) / 6.0)
