"""Streamlines of a velocity field, many at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from coop_drake.fields.points import as_points
from coop_drake.fields.velocity_field import VelocityField
from coop_drake.geometry.parts import extent_of
from coop_drake.tree.pose import FloatArray

_TURN = 0.2
"""Largest turn of the direction within a step [rad]."""
_LONGEST = 0.05
"""Longest step, per size of the region [-]."""
_FIRST = 1e-3
"""First step, per size of the region [-]."""
_GROWTH = 1.6
"""Growth of the next step where the direction hardly turns [-]."""
_ARRIVED = 0.01
"""Distance from the goal at which a streamline has arrived, per slowdown radius [-]."""


@dataclass(frozen=True)
class Streamlines:
    """Streamlines of a velocity field and their travel times.

    Attributes:
        paths: For each start its streamline, shape (points, 2) [m].
        times: Time until each is within a hundredth of the slowdown radius of the goal, infinite if it does
            not get there, shape (n,) [s].
    """

    paths: tuple[FloatArray, ...]
    times: FloatArray

    @property
    def arrived(self) -> NDArray[np.bool_]:
        """Whether each start arrives, shape (n,)."""
        return np.isfinite(self.times)


def trace_streamlines(field: VelocityField, starts: ArrayLike, *, max_steps: int = 2_000) -> Streamlines:
    """Follow a field from many starts by Heun's rule, with steps in which its direction hardly turns.

    A step that would leave the region or turn too much is tried again at half its length.

    Args:
        field: The field.
        starts: Points in the map's region, shape (n, 2) [m].
        max_steps: Attempted steps after which a streamline counts as not arriving.

    Raises:
        FieldError: If the starts have another shape or are not finite.
    """
    here = as_points(starts).reshape(-1, 2).copy()
    goal, region = field.harmonic_map.goal, field.harmonic_map.region
    size, close = extent_of(region), _ARRIVED * field.slowdown_radius
    times, reach = np.zeros(len(here)), np.full(len(here), _FIRST * size)
    going = np.flatnonzero(shapely.distance(goal, shapely.points(here)) > close)
    history = [(np.arange(len(here)), here.copy())]
    shapely.prepare(region)
    for _ in range(max_steps):
        if not len(going):
            break
        p = here[going]
        left = np.asarray(shapely.distance(goal, shapely.points(p)))
        step = np.minimum(reach[going], np.where(left > 2.0 * close, 0.5 * left, left - 0.99 * close))
        first = field(p)
        second = field(p + step[:, None] * _unit(first))
        after = p + 0.5 * step[:, None] * (_unit(first) + _unit(second))
        turn = np.linalg.norm(_unit(second) - _unit(first), axis=1)
        chords = shapely.linestrings(np.stack((p, after), axis=1))
        good = (turn < _TURN) & shapely.covers(region, chords)
        moved = going[good]
        here[moved] = after[good]
        times[moved] += (step * _slowness(first, second))[good]
        history.append((moved, after[good]))
        growth = np.where(good, np.where(turn < 0.5 * _TURN, _GROWTH, 1.0), 0.5)
        reach[going] = np.minimum(step * growth, _LONGEST * size)
        going = going[~good | (shapely.distance(goal, shapely.points(here[going])) > close)]
    times[going] = np.inf
    return Streamlines(_paths(history, len(here)), times)


def _paths(history: list[tuple[NDArray[np.intp], FloatArray]], count: int) -> tuple[FloatArray, ...]:
    """Points of each streamline in order, from the steps of all of them."""
    owner = np.concatenate([moved for moved, _ in history])
    points = np.concatenate([places for _, places in history])
    order = np.argsort(owner, kind="stable")
    ends = np.cumsum(np.bincount(owner, minlength=count))[:-1]
    return tuple(np.split(points[order], ends))


def _unit(vectors: FloatArray) -> FloatArray:
    """Directions of vectors (n, 2); zero stays zero."""
    lengths = np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    return np.asarray(vectors / lengths)


def _slowness(first: FloatArray, second: FloatArray) -> FloatArray:
    """Mean of 1 / speed between two points by Simpson's rule (n,) [s/m]."""
    before, after = (np.maximum(np.linalg.norm(v, axis=1), 1e-300) for v in (first, second))
    return np.asarray((1.0 / before + 8.0 / (before + after) + 1.0 / after) / 6.0)
