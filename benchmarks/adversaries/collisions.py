"""Configurations that surely collide, found by sampling; written for a question's document alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

FloatArray = NDArray[np.float64]
Document = dict[str, Any]

DEPTH = 1e-7
"""Pieces are shrunk by this before they are tested: what still meets something surely collides [m]."""


def polygon_of(region: Document) -> BaseGeometry:
    """All points of odd parity of a region's rings [m]."""
    found: BaseGeometry = Polygon()
    for ring in (region["outer"], *region["holes"]):
        found = found.symmetric_difference(shapely.make_valid(Polygon(ring)))
    return found


def floor_of(question: Document) -> BaseGeometry:
    """The floor of a question, prepared for many tests [m]."""
    floor = polygon_of(question["floor"])
    shapely.prepare(floor)
    return floor


@dataclass(frozen=True)
class Piece:
    """A convex piece in its component's frame.

    Attributes:
        body: Name of its body.
        component: Index of its component.
        hull: The hull of its vertices.
        radius: By how much the hull is grown [m].
        whole: The piece, with inscribed arcs.
        inner: What of it keeps ``DEPTH`` from its boundary; may be empty.
    """

    body: str
    component: int
    hull: BaseGeometry
    radius: float
    whole: BaseGeometry
    inner: BaseGeometry


class Team:
    """The bodies of a question.

    Args:
        question: Its document.
    """

    def __init__(self, question: Document) -> None:
        self._components = question["components"]
        self.pieces = [
            Piece(piece["body"], piece["component"], *_shapes(piece)) for piece in question["pieces"]
        ]
        aside = {tuple(entry[:2]) for entry in question["left_aside"]}
        self.pairs = [
            (i, j)
            for (i, a), (j, b) in combinations(enumerate(self.pieces), 2)
            if a.component != b.component and (i, j) not in aside
        ]
        self._floor = floor_of(question)
        rings = [question["floor"]["outer"], *question["floor"]["holes"]]
        self._walls = shapely.MultiLineString([[*ring, ring[0]] for ring in rings])
        shapely.prepare(self._walls)

    @cached_property
    def axes(self) -> list[list[int]]:
        """For each component the axes of (theta, q...) that move it."""
        axes: list[list[int]] = [[0]]
        for component in self._components:
            axes.append([*axes[component["parent"]], 1 + component["joint"]])
        return axes

    def frames(self, angles: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Origins (N, 2) and angles (N,) of all components, p_WL = 0, for (theta, q...), shape (N, 1 + n)."""
        frames = [(np.zeros((len(angles), 2)), angles[:, 0])]
        for component in self._components:
            place, turned = frames[component["parent"]]
            value = angles[:, 1 + component["joint"]]
            moved = value[:, None] * np.array(component["slide"]) + np.array(component["offset"])
            here = turned + component["sign"] * value + component["angle"]
            frames.append((place + _turned(moved, turned), here))
        return frames

    def placed(self, index: int, angles: FloatArray, *, inner: bool) -> NDArray[np.object_]:
        """A piece, or the smaller one inside, for p_WL = 0 and (theta, q...), shape (N, 1 + n) to (N,)."""
        piece = self.pieces[index]
        place, angle = self.frames(angles)[piece.component]
        shape = piece.inner if inner else piece.whole
        corners = shapely.get_coordinates(shape)
        rings = place[:, None] + _turned(
            np.broadcast_to(corners, (len(angles), *corners.shape)), angle[:, None]
        )
        return np.asarray(shapely.polygons(rings))

    def collides(self, configurations: FloatArray) -> NDArray[np.bool_]:
        """Whether pieces surely meet a wall, leave the floor or meet; z (N, 3 + n) to (N,)."""
        positions, angles = configurations[:, :2], configurations[:, 2:]
        result = np.zeros(len(configurations), dtype=bool)
        if not len(configurations):
            return result
        inner = [self.placed(k, angles, inner=True) for k in range(len(self.pieces))]
        for shapes in inner:
            moved = _moved(shapes, positions)
            result |= shapely.intersects(self._walls, moved)
            result |= ~shapely.contains_xy(
                self._floor, shapely.get_coordinates(shapely.get_point(shapely.get_exterior_ring(moved), 0))
            )
        for i, j in self.pairs:
            result |= shapely.intersects(inner[i], inner[j])
        return result


def boxes_sampled(
    lower: FloatArray, upper: FloatArray, random: np.random.Generator, count: int
) -> FloatArray:
    """Points of a box: ends of all axes, and random ones, shape (count, axes)."""
    share = random.random((count, len(lower)))
    share[: count // 2] = np.rint(share[: count // 2])
    return np.asarray(lower + share * (upper - lower))


def positions_sampled(region: BaseGeometry, random: np.random.Generator, count: int) -> FloatArray:
    """Points of a region: its corners, points along its boundary, and random ones inside, shape (k, 2)."""
    corners = shapely.get_coordinates(region)
    if not len(corners):
        return np.empty((0, 2))
    low, high = corners.min(axis=0), corners.max(axis=0)
    inside = random.uniform(low, high, (4 * count, 2))
    inside = inside[shapely.contains_xy(region, inside)][:count]
    boundary: Any = shapely.boundary(region)
    along = shapely.line_interpolate_point(boundary, random.random(count), normalized=True)
    return np.concatenate((random.permutation(corners)[:count], shapely.get_coordinates(along), inside))


def _shapes(shape: Document) -> tuple[BaseGeometry, float, BaseGeometry, BaseGeometry]:
    """Hull, radius, whole and inner shape of a piece."""
    hull = shapely.MultiPoint(shape["corners"]).convex_hull
    whole = hull.buffer(shape["radius"], quad_segs=16) if shape["radius"] > 0.0 else hull
    return hull, shape["radius"], whole, whole.buffer(-DEPTH, join_style="mitre")


def _moved(shapes: NDArray[np.object_], positions: FloatArray) -> NDArray[np.object_]:
    counts = shapely.get_num_coordinates(shapes)
    return np.asarray(
        shapely.set_coordinates(
            shapes.copy(), shapely.get_coordinates(shapes) + np.repeat(positions, counts, axis=0)
        )
    )


def _turned(vectors: FloatArray, angles: FloatArray) -> FloatArray:
    """Vectors turned by angles, shapes (..., 2) and (...)."""
    c, s = np.cos(angles), np.sin(angles)
    return np.stack(
        (c * vectors[..., 0] - s * vectors[..., 1], s * vectors[..., 0] + c * vectors[..., 1]), axis=-1
    )
