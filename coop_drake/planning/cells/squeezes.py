"""Positions at which walls on either side hold two round pieces so near to each other that these overlap.

Pieces that are swept over a slice one by one lose accuracy in proportion to the slice's width. Here what the
walls leave to two bases is compared with the vector between them, which loses accuracy along the walls alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin
from typing import NamedTuple

import numpy as np
import shapely

from coop_drake.geometry.distances import squared_distance
from coop_drake.geometry.sweeps import edge_directions, support
from coop_drake.geometry.swept_tree import BodyPairs, Intervals, SweptTree
from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray, PlanarPose

LARGEST_BREADTH = 0.15
"""Cells that are broader than this times the smallest radius (area over perimeter) are not tried [-]."""

LARGEST_DISTANCE = 1.5
"""Pieces are not tried that are everywhere further apart than this times the sum of their radii [-]."""

SPARE = 1e-6
"""All statements must hold with this to spare [m], for rounding."""

PARTS = 16
"""Copies of what turns by an interval are this part of it apart [-], as in the exact checker."""


Places = tuple[FloatArray, float]
"""Corners of a convex set, shape (n, 2), and how far it reaches beyond them [m]."""


@dataclass(frozen=True, eq=False)
class SqueezedPair:
    """Positions that are forbidden all over a slice, because two round pieces touch a wall or each other.

    Attributes:
        pieces: Indices of the pieces in ``SweptTree.pieces``.
        polygon: The positions: corners of a convex polygon, counter-clockwise, shape (n, 2) [m].
        cuts: For each piece unit vectors u and limits [m], shape (c, 3). Where its centre a has u . a above a
            limit, and not above those before it, it touches a wall.
    """

    pieces: tuple[int, int]
    polygon: FloatArray
    cuts: tuple[FloatArray, FloatArray]


class _Candidate(NamedTuple):
    """Two discs in a slice: pieces, their centres' places about p, vectors between these, radii, and loss."""

    pieces: tuple[int, int]
    places: tuple[FloatArray, FloatArray]
    apart: FloatArray
    radii: FloatArray
    loss: float


class Squeezes:
    """Looks for squeezed pairs.

    Args:
        swept: Sweeps of the team's pieces.
        pairs: Pairs of bodies that must not touch.
        walls: The walls, shape (m, 4) as (x0, y0, x1, y1) [m].

    Attributes:
        breadth: Cells that are broader (area over perimeter) are not worth a trial [m]; 0 without two discs.
    """

    def __init__(self, swept: SweptTree, pairs: BodyPairs, walls: FloatArray) -> None:
        self._swept = swept
        self._known: dict[tuple[object, ...], Places] = {}
        self._lower = np.minimum(walls[:, :2], walls[:, 2:])
        self._upper = np.maximum(walls[:, :2], walls[:, 2:])
        self._walls = walls
        shapes = [piece.shape for piece in swept.pieces]
        self._pairs = [
            (i, j, first, second, np.array([shapes[i].radius, shapes[j].radius]))
            for i, j, first, second in pairs.pieces.tolist()
            if len(shapes[i].vertices) == len(shapes[j].vertices) == 1
        ]
        least = min([radii.min() for *_, radii in self._pairs], default=0.0)
        self.breadth = LARGEST_BREADTH * least

    def find(self, intervals: Intervals, corners: FloatArray, growth: float) -> SqueezedPair | None:
        """A pair that is squeezed at all configurations of a slice and at all positions of a cell, if any is.

        Args:
            intervals: The slice.
            corners: Corners of the cell, shape (n, 2) [m].
            growth: The positions reach at least 0.7 times this beyond the cell's convex hull [m].
        """
        pairs = self._candidates(intervals)
        if not pairs:
            return None
        hull = shapely.MultiPoint(corners).convex_hull.buffer(growth, quad_segs=1)
        ring = convex_hull(shapely.get_coordinates(hull))
        for pair in pairs:
            one, other = (convex_hull((ring[:, None] + about).reshape(-1, 2)) for about in pair.places)
            near = self._near(np.concatenate((one, other)), float(pair.radii.max()))
            overlapping, cuts, first = squeezed(one, other, pair.apart, near, pair.radii, pair.loss)
            if overlapping:
                return SqueezedPair(pair.pieces, ring, (cuts[:first], cuts[first:]))
        return None

    def _candidates(self, intervals: Intervals) -> list[_Candidate]:
        """Pairs near enough to each other somewhere in a slice."""
        found = []
        for i, j, first, second, radii in self._pairs:
            apart, spread = self._apart(intervals, i, j, first, second)
            if np.hypot(*apart.T).min() < LARGEST_DISTANCE * radii.sum():
                (one, grown), (other, more) = self._places(i, intervals), self._places(j, intervals)
                found.append(_Candidate((i, j), (one, other), apart, radii, SPARE + max(grown, more, spread)))
        return found

    def _places(self, index: int, intervals: Intervals, stages: int | None = None) -> Places:
        """Where a disc's centre may be after some stages of its chain, all if none are given."""
        piece = self._swept.pieces[index]
        axes = piece.axes[:stages]
        key = (index, len(axes), *[intervals[axis] for axis in axes])
        if key not in self._known:
            steps = list(zip(piece.chain, axes, strict=False))
            self._known[key] = self._moved((piece.shape.vertices, 0.0), steps, intervals, sliding=True)
        return self._known[key]

    def _apart(self, intervals: Intervals, i: int, j: int, first: int, second: int) -> Places:
        """All vectors from one centre to another, in directions of W."""
        pieces = self._swept.pieces
        key = (i, j, "apart", *[intervals[axis] for axis in (*pieces[i].axes, *pieces[j].axes)])
        if key not in self._known:
            one, grown = self._places(i, intervals, first)
            other, more = self._places(j, intervals, second)
            between = convex_hull((other[:, None] - one).reshape(-1, 2)), grown + more
            steps = list(zip(pieces[i].chain[first:], pieces[i].axes[first:], strict=True))
            self._known[key] = self._moved(between, steps, intervals, sliding=False)
        return self._known[key]

    def _moved(
        self, places: Places, steps: list[tuple[int, int]], intervals: Intervals, *, sliding: bool
    ) -> Places:
        """Places that are moved by the joints of components, each with its axis, or only turned by them.

        A point at the distance r is nowhere further than r b^2 / 8 from the segment between two of its copies
        that are turned by b against each other.
        """
        points, grown = places
        for component, axis in steps:
            joint, (low, high) = self._swept.tree.components[component].joint, intervals[axis]
            X = PlanarPose(0.0, 0.0, 0.0) if joint is None else joint.X_PJ
            if joint is None or joint.kind == "revolute":
                grown += float(np.hypot(*points.T).max()) * ((high - low) / PARTS) ** 2 / 8.0
                turns = (1.0 if joint is None else joint.sign) * np.linspace(low, high, PARTS + 1)
                c, s, (x, y) = np.cos(turns)[:, None], np.sin(turns)[:, None], points.T
                points = convex_hull(np.stack((c * x - s * y, s * x + c * y), axis=-1).reshape(-1, 2))
            elif sliding:
                ends = np.array([low, high])[:, None, None] * np.array(joint.axis)
                points = convex_hull((points + ends).reshape(-1, 2))
            points = (X if sliding else PlanarPose(0.0, 0.0, X.angle)).apply(points)
        return points, grown

    def _near(self, places: FloatArray, distance: float) -> FloatArray:
        """Walls whose boxes are not further than a distance from places, shape (k, 4) [m]."""
        low, high = places.min(axis=0) - distance, places.max(axis=0) + distance
        near: FloatArray = self._walls[((self._lower <= high) & (self._upper >= low)).all(axis=1)]
        return near


# Compiled: whether two discs overlap.

_BEYOND = 1e-3
"""How far below all points a limit is that cuts off all of them [m]."""

_SHORTEST = 1e-7
"""Shorter edges are remnants of rounding, with any direction [m]."""

_HALVINGS = 30
"""Halvings with which the place is found where an edge leaves the neighbourhood of a wall [-]."""


@compiled
def convex_hull(points: FloatArray) -> FloatArray:
    """Corners of the convex hull of points, counter-clockwise; shapes (n, 2) to (m, 2) [m].

    From the point furthest to the left it goes to the one that has no other one to its right, and so on.
    """
    first = 0
    for k in range(1, len(points)):
        lower = points[k, 0] == points[first, 0] and points[k, 1] < points[first, 1]
        first = k if points[k, 0] < points[first, 0] or lower else first
    corners, here = np.empty_like(points), first
    for count in range(len(points)):
        corners[count] = points[here]
        bx, by = 0.0, 0.0
        for k in range(len(points)):
            x, y = points[k, 0] - corners[count, 0], points[k, 1] - corners[count, 1]
            right = bx * y - by * x
            if right < 0.0 or (right == 0.0 and x * x + y * y > bx * bx + by * by):
                bx, by, here = x, y, k
        if points[here, 0] == points[first, 0] and points[here, 1] == points[first, 1]:
            return corners[: count + 1]
    return corners


@compiled
def below(ring: FloatArray, ux: float, uy: float, most: float) -> FloatArray:
    """The part of a convex ring where u . x <= most; shapes (n, 2) to (m, 2), no rows if it is empty [m]."""
    found, count = np.empty((2 * len(ring), 2)), 0
    for i in range(len(ring)):
        ax, ay, bx, by = ring[i - 1, 0], ring[i - 1, 1], ring[i, 0], ring[i, 1]
        s, t = ux * ax + uy * ay - most, ux * bx + uy * by - most
        if (s <= 0.0) != (t <= 0.0):
            found[count, 0], found[count, 1] = (bx * s - ax * t) / (s - t), (by * s - ay * t) / (s - t)
            count += 1
        if t <= 0.0:
            found[count, 0], found[count, 1] = bx, by
            count += 1
    return found[:count]


@compiled
def _clear_part(
    ring: FloatArray, walls: FloatArray, radius: float, loss: float, cuts: FloatArray, count: int
) -> tuple[FloatArray, int]:
    """Cut off from the places of a disc's centre where it touches a wall; cuts (ux, uy, limit) are appended.

    Beyond the line u . x = limit all places are nearer to one wall than the radius; u is a wall's normal.
    """
    clear = (radius - loss) * (radius - loss)
    for k in range(2 * len(walls)):
        wall, side = walls[k // 2], 1.0 - 2.0 * (k % 2)
        ux, uy = side * (wall[3] - wall[1]), side * (wall[0] - wall[2])
        length = hypot(ux, uy)
        if length == 0.0 or len(ring) == 0:
            continue
        ux, uy = ux / length, uy / length
        # The largest u . x of the ring's points that keep the radius from the wall. It is that of a corner,
        # or of a point where an edge is at this distance from the wall, because the points nearer to it are a
        # convex set. If all are nearer, it is below all u . x of the ring.
        furthest = (ux * ring[:, 0] + uy * ring[:, 1]).min() - _BEYOND
        for i in range(len(ring)):
            ax, ay, bx, by = ring[i - 1, 0], ring[i - 1, 1], ring[i, 0], ring[i, 1]
            held = squared_distance(ax, ay, wall[0], wall[1], wall[2], wall[3]) < clear
            after = squared_distance(bx, by, wall[0], wall[1], wall[2], wall[3]) < clear
            if not after:
                furthest = max(furthest, ux * bx + uy * by)
            if held != after:
                if not held:
                    ax, ay, bx, by = bx, by, ax, ay
                for _ in range(_HALVINGS):
                    mx, my = 0.5 * (ax + bx), 0.5 * (ay + by)
                    if squared_distance(mx, my, wall[0], wall[1], wall[2], wall[3]) < clear:
                        ax, ay = mx, my
                    else:
                        bx, by = mx, my
                furthest = max(furthest, ux * bx + uy * by)
        limit = furthest + loss
        if (ux * ring[:, 0] + uy * ring[:, 1]).max() > limit + loss:
            cuts[count, 0], cuts[count, 1], cuts[count, 2] = ux, uy, limit
            ring, count = below(ring, ux, uy, limit + loss), count + 1
    return ring, count


@compiled
def squeezed(
    first: FloatArray,
    second: FloatArray,
    apart: FloatArray,
    walls: FloatArray,
    radii: FloatArray,
    loss: float,
) -> tuple[bool, FloatArray, int]:
    """Whether walls hold two discs so near to each other that they overlap.

    Cuts leave places of the first centre, a, and of the second one, b, beyond which a disc touches a wall. Of
    all vectors b - a from the slice, those that also lead from a place left to the first to one left to the
    second must be shorter than the sum of the radii.

    Args:
        first: Convex ring of all places of the first disc's centre, counter-clockwise, shape (n, 2) [m].
        second: That of the second one's.
        apart: Convex ring of all b - a, shape (m, 2) [m].
        walls: Walls near both, shape (k, 4) as (x0, y0, x1, y1) [m].
        radii: Their radii, shape (2,) [m].
        loss: What every statement must hold with to spare [m].

    Returns:
        Whether they overlap; cuts (ux, uy, limit), shape (c, 3); how many of them are the first disc's.
    """
    cuts = np.empty((4 * len(walls), 3))
    one, count = _clear_part(first, walls, radii[0], loss, cuts, 0)
    other, total = _clear_part(second, walls, radii[1], loss, cuts, count)
    if len(one) > 0 and len(other) > 0:
        for ring in (other, -one):
            normals = edge_directions(ring)
            room = support(other, normals) + support(-one, normals) + 3.0 * loss
            for k in range(len(normals)):
                length = hypot(
                    ring[k, 0] - ring[(k + 1) % len(ring), 0], ring[k, 1] - ring[(k + 1) % len(ring), 1]
                )
                if length > _SHORTEST and len(apart) > 0:
                    apart = below(apart, cos(normals[k]), sin(normals[k]), room[k])
        if len(apart) > 0 and np.hypot(apart[:, 0], apart[:, 1]).max() >= radii[0] + radii[1] - loss:
            return False, cuts[:0], 0
    return True, cuts[:total], count
