"""Cells of one compound slice, eqs. (5), (8): what is free for sure, and what may be free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import cos, hypot, sin
from typing import NamedTuple

import numpy as np
import shapely
from manifold3d import CrossSection
from shapely import MultiPolygon, Polygon

from coop_drake.geometry.minkowski import FreeSpace, components, meet, shared, to_polygon
from coop_drake.geometry.polygons import BoundaryDistance, squared_distance
from coop_drake.geometry.sweeps import edge_directions, following, support
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import PlanarPose

NEGLIGIBLE_AREA = 1e-9
"""Under-cells with less area are dropped: they are remnants of rounding [m^2]."""

SQUEEZE_GROWTH = 1e-3
"""Squeezed pairs are asked for so far beyond an over-cell [m]: what a proof leaves free is a little wider."""


@dataclass(frozen=True, eq=False)
class Region:
    """One connected set of positions p_WL.

    Attributes:
        section: The set itself, with holes.
        bounds: (x_min, y_min, x_max, y_max) [m].
        area: Its area [m^2].
    """

    section: CrossSection
    bounds: tuple[float, float, float, float]
    area: float

    @classmethod
    def of(cls, section: CrossSection) -> Region:
        """Measure a connected section."""
        return cls(section, section.bounds(), section.area())

    @cached_property
    def rings(self) -> list[FloatArray]:
        """Boundary rings, shape (n, 2) each [m]."""
        return [np.asarray(ring, dtype=float) for ring in self.section.to_polygons()]

    @cached_property
    def breadth(self) -> float:
        """Area over perimeter; for a long strip that is half its width [m]."""
        perimeter = sum(float(np.hypot(*(following(ring) - ring).T).sum()) for ring in self.rings)
        return self.area / perimeter

    def holds(self, point: FloatArray) -> bool:
        """Whether a point, shape (2,) [m], lies inside."""
        return bool(self.depths(point[None])[0] > 0.0)

    def near(self, point: FloatArray, room: float) -> bool:
        """Whether a point, shape (2,), lies inside, or no further than some room from it [m]."""
        return bool(self.depths(point[None])[0] >= -room)

    def depths(self, points: FloatArray) -> FloatArray:
        """Signed distances from the boundary, positive inside (even-odd rule); shape (k, 2) to (k,) [m]."""
        return self.boundary.batch(points)

    @cached_property
    def boundary(self) -> BoundaryDistance:
        """Signed distance from its boundary."""
        return BoundaryDistance(to_polygon(self.section))

    def meets(self, other: Region, *, otherwise: bool = True) -> bool:
        """Whether both sets share more than their boundary; ``otherwise`` if geometry fails."""
        a, b = self.bounds, other.bounds
        if a[0] > b[2] or b[0] > a[2] or a[1] > b[3] or b[1] > a[3]:
            return False
        return meet(self.section, other.section, otherwise=otherwise)


@dataclass(frozen=True, eq=False)
class FreeBox:
    """A set of configurations proved free: every position in ``polygon`` with every angle in the intervals.

    Attributes:
        polygon: Positions p_WL, one connected component of the under-approximation [m]; empty while only the
            positions of a path are known.
        lower: Lower ends of (theta, q...), expanded by the overlap, circular axes unwrapped, shape
            (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        positions: Where a path passes the box: its team is free at every point of the polyline through them,
            for all angles in the intervals, shape (k, 2) [m]; no rows of a box that was found without a path.
    """

    polygon: Polygon
    lower: FloatArray
    upper: FloatArray
    positions: FloatArray = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def intervals(self) -> Intervals:
        """Interval of every axis (theta, q...)."""
        return tuple(zip(self.lower.tolist(), self.upper.tolist(), strict=True))

    @classmethod
    def of(cls, intervals: Intervals, region: Region) -> FreeBox:
        """A box of some intervals whose positions are those of a region."""
        lower, upper = np.array(intervals).T.copy()
        return cls(to_polygon(region.section), lower, upper)


# Positions at which walls on either side hold two round pieces so near to each other that these overlap.
#
# Pieces that are swept over a slice one by one lose accuracy in proportion to the slice's width. Here what
# the walls leave to two bases is compared with the vector between them, which loses accuracy along the walls
# alone.

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
        walls: The walls, shape (m, 4) as (x0, y0, x1, y1) [m].

    Attributes:
        breadth: Cells that are broader (area over perimeter) are not worth a trial [m]; 0 without two discs.
    """

    def __init__(self, swept: SweptTree, walls: FloatArray) -> None:
        self._swept = swept
        self._known: dict[tuple[object, ...], Places] = {}
        self._lower = np.minimum(walls[:, :2], walls[:, 2:])
        self._upper = np.maximum(walls[:, :2], walls[:, 2:])
        self._walls = walls
        shapes = [piece.shape for piece in swept.pieces]
        self._pairs = [
            (i, j, first, second, np.array([shapes[i].radius, shapes[j].radius]))
            for i, j, first, second in swept.arrays.pairs.tolist()
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


# The cells of slices.


class CellMaker:
    """Makes the cells of slices; positions of a component are cached by the intervals that move it.

    Over-cells hold all free positions, so they need spaces that are too large (``FreeSpace.over``) and bodies
    that are too small (``SweptTree.under``, covered at every configuration). Under-cells hold free positions
    only, so they need spaces that are too small (``FreeSpace.under``) and bodies that are too large
    (``SweptTree.over``).

    Args:
        swept: Sweeps of the team's pieces.
        workspace: Where the team may be; the margin is already taken off [m].
        squeezing: Whether over-cells leave out where two round pieces are squeezed between walls.

    Attributes:
        pairs: Self-collision of the team.
        moving_axes: For each component the axes (theta, q...) that move it; none if it has no bodies.
        squeezed: How often such a pair was found.
    """

    def __init__(
        self,
        swept: SweptTree,
        workspace: Polygon | MultiPolygon,
        *,
        squeezing: bool = False,
    ) -> None:
        self.squeezed = 0
        self._swept, self.pairs = swept, swept.pairs
        self._under_space, self._over_space = FreeSpace.under(workspace), FreeSpace.over(workspace)
        squeezes = Squeezes(swept, self._over_space.edges) if squeezing else None
        self._squeezes = squeezes if squeezes is not None and squeezes.breadth > 0.0 else None
        self._everywhere = self._positions(workspace)
        self._members = [
            [n for n, piece in enumerate(swept.pieces) if piece.component == c]
            for c in range(len(swept.tree.components))
        ]
        self.moving_axes = [swept.pieces[members[0]].axes if members else () for members in self._members]
        self._under: dict[tuple[object, ...], CrossSection | None] = {}
        self._over: dict[tuple[object, ...], CrossSection | None] = {}
        self._cells: dict[Intervals, list[Region]] = {}

    def _positions(self, workspace: Polygon | MultiPolygon) -> CrossSection:
        """A box that holds every position at which the team can be inside the workspace."""
        x_min, y_min, x_max, y_max = workspace.bounds
        reach = self._swept.tree.reach + 1.0
        size = (x_max - x_min + 2.0 * reach, y_max - y_min + 2.0 * reach)
        return CrossSection.square(size).translate((x_min - reach, y_min - reach))

    def over_cells(self, intervals: Intervals) -> list[Region]:
        """Regions outside which no configuration of the nominal slice is free."""
        if intervals not in self._cells:  # Trial splits ask for halves that may become slices.
            free = self.pairs.overlapping(intervals) is None
            found = regions_of(self._common(intervals, over=True), over=True) if free else []
            self._cells[intervals] = self.unsqueezed(intervals, found, SQUEEZE_GROWTH)[1]
        return self._cells[intervals]

    def unsqueezed(
        self, intervals: Intervals, regions: Sequence[Region], growth: float
    ) -> tuple[list[SqueezedPair], list[Region]]:
        """Pairs that are squeezed all over a slice in some regions, and the other regions.

        Args:
            intervals: The slice.
            regions: Over-approximations of its free positions.
            growth: How far the pairs' positions reach beyond the regions, about [m].
        """
        found, rest = list[SqueezedPair](), list[Region]()
        for region in regions:
            pair = None
            if self._squeezes is not None and region.breadth < self._squeezes.breadth:
                pair = self._squeezes.find(intervals, np.concatenate(region.rings), growth)
            if pair is None:
                rest.append(region)
            else:
                found.append(pair)
        self.squeezed += len(found)
        return found, rest

    def under_cells(self, expanded: Intervals) -> list[Region]:
        """Regions in which every configuration of the expanded slice is free."""
        if self.pairs.touching(expanded) is not None:
            return []
        regions = regions_of(self._common(expanded, over=False), over=False)
        return [region for region in regions if region.area > NEGLIGIBLE_AREA]

    def guide_cells(self, intervals: Intervals) -> list[Region]:
        """Free regions of the slice's middle configuration; they guide the search and prove nothing."""
        middle = tuple((0.5 * (lower + upper), 0.5 * (lower + upper)) for lower, upper in intervals)
        return self.under_cells(middle)

    def places_for(self, component: int, angles: Sequence[float]) -> list[Region]:
        """Positions at which one component, with bodies, is free at some angles (theta, q...)."""
        section = self._under_component(component, tuple((angle, angle) for angle in angles))
        return [] if section is None else regions_of(section, over=False)

    def _common(self, intervals: Intervals, *, over: bool) -> CrossSection:
        """Positions allowed by all components; all positions if no component restricts them."""
        region: CrossSection | None = None
        for component in reversed(range(len(self._members))):
            one = (self._over_component if over else self._under_component)(component, intervals)
            region = _shared(region, one, over)
            if region is not None and region.is_empty():
                return region
        return self._everywhere if region is None else region

    def _under_component(self, component: int, expanded: Intervals) -> CrossSection | None:
        key = (component, *[expanded[axis] for axis in self.moving_axes[component]])
        if key not in self._under:
            found: CrossSection | None = None
            for index in self._members[component]:
                found = _shared(found, self._under_space.minus(self._swept.over(index, expanded)), False)
                if found is not None and found.is_empty():
                    break
            self._under[key] = found
        return self._under[key]

    def _over_component(self, component: int, intervals: Intervals) -> CrossSection | None:
        key = (component, *[intervals[axis] for axis in self.moving_axes[component]])
        if key not in self._over:
            found: CrossSection | None = None
            for index in self._members[component]:
                footprint = self._swept.under(index, intervals)
                if footprint is not None:
                    found = _shared(found, self._over_space.minus(footprint), True)
            self._over[key] = found
        return self._over[key]


def _shared(first: CrossSection | None, second: CrossSection | None, over: bool) -> CrossSection | None:
    """Intersection of two regions; None stands for all positions."""
    if first is None or second is None:
        return second if first is None else first
    return shared(first, second, over=over)


def regions_of(section: CrossSection, *, over: bool) -> list[Region]:
    """Connected parts of a section, in a fixed order.

    Args:
        section: A region.
        over: Whether the section is an over-approximation of the free positions; else an under-approximation.
    """
    return sorted(map(Region.of, components(section, over=over)), key=lambda region: region.bounds)
