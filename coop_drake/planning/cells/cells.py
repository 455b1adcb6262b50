"""Cells of one compound slice, eqs. (5), (8): what is free for sure, and what may be free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from manifold3d import CrossSection
from shapely import MultiPolygon, Polygon

from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.geometry.minkowski import FreeSpace, components, meet, shared, to_polygon
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.geometry.sweeps import following, normals
from coop_drake.geometry.swept_tree import BodyPairs, Intervals, SweptTree
from coop_drake.planning.cells.squeezes import SqueezedPair, Squeezes
from coop_drake.tree.component_tree import nearest_turn
from coop_drake.tree.pose import FloatArray

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
        polygon: Positions p_WL, one connected component of the under-approximation at margin zero [m]; empty
            while only the positions of a path are known.
        core: The positions that keep the plan's margin, one connected component; a subset of ``polygon`` [m].
        lower: Lower ends of (theta, q...), expanded by the overlap, circular axes unwrapped, shape
            (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        positions: Where a path passes the box: its team is free at every point of the polyline through them,
            for all angles in the intervals, shape (k, 2) [m]; no rows of a box that was found without a path.
    """

    polygon: Polygon
    core: Polygon
    lower: FloatArray
    upper: FloatArray
    positions: FloatArray = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def intervals(self) -> Intervals:
        """Interval of every axis (theta, q...)."""
        return tuple(zip(self.lower.tolist(), self.upper.tolist(), strict=True))

    @classmethod
    def of(cls, intervals: Intervals, region: Region) -> FreeBox:
        """A box of some intervals whose positions are those of a region, at no margin."""
        lower, upper = np.array(intervals).T.copy()
        polygon = to_polygon(region.section)
        return cls(polygon, polygon, lower, upper)


class CellMaker:
    """Makes the cells of slices; positions of a component are cached by the intervals that move it.

    Over-cells hold all free positions, so they need spaces that are too large (``FreeSpace.over``) and bodies
    that are too small (``SweptTree.under``, covered at every configuration). Under-cells hold free positions
    only, so they need spaces that are too small (``FreeSpace.under``) and bodies that are too large
    (``SweptTree.over``).

    Args:
        swept: Sweeps of the team's pieces.
        pairs: Self-collision of the team.
        workspace: Where the team may be; the margin is already taken off [m].
        squeezing: Whether over-cells leave out where two round pieces are squeezed between walls.

    Attributes:
        pairs: Self-collision of the team, as given.
        moving_axes: For each component the axes (theta, q...) that move it; none if it has no bodies.
        squeezed: How often such a pair was found.
    """

    def __init__(
        self,
        swept: SweptTree,
        pairs: BodyPairs,
        workspace: Polygon | MultiPolygon,
        *,
        squeezing: bool = False,
    ) -> None:
        self.squeezed = 0
        self._swept, self.pairs = swept, pairs
        self._under_space, self._over_space = FreeSpace.under(workspace), FreeSpace.over(workspace)
        squeezes = Squeezes(swept, pairs, self._over_space.edges) if squeezing else None
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


# Where a transport ends within its goal, if not in its middle: that is in collision, or beyond a limit.

LEAST_END_SHARE = 0.1
"""Share of a tolerance about an end that a cell leaves at least, so that a team can come to rest [-]."""

_END_FAN = (
    np.array([0.25, 0.5, 0.75])[:, None, None] * normals(np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False))
).reshape(-1, 2)
"""Positions within a tolerance of 1 that are tried, shape (48, 2) [-]."""


def end_in(problem: PlanningProblem, intervals: Intervals, boundary: BoundaryDistance) -> FloatArray | None:
    """A configuration of the goal in a cell that is free, its middle if possible; None if there is no room.

    Args:
        problem: The question.
        intervals: The cell's intervals of (theta, q...).
        boundary: Distance from the boundary of its positions.

    Returns:
        z, theta as in the intervals, joints without a goal in the middle of theirs, shape (3 + n,) [m, rad].
    """
    place, values = _place_in(problem, boundary), list[float]()
    goals, circular = (float(problem.goal_pose[2]), *problem.goal_joints), problem.tree.circular
    for (a, b), (low, high), goal, periodic in zip(
        intervals, goal_box(problem), goals, circular, strict=True
    ):
        middle = 0.5 * (a + b)
        if goal is None:
            values.append(middle)
            continue
        turns = middle + nearest_turn(goal - middle) - goal if periodic else 0.0
        lower, upper = max(a, low + turns), min(b, high + turns)
        if lower <= goal + turns <= upper:
            values.append(goal + turns)
        elif upper - lower >= LEAST_END_SHARE * (high - low) > 0.0:
            values.append(0.5 * (lower + upper))
    return None if place is None or len(values) < len(intervals) else np.array([*place, *values])


def _place_in(problem: PlanningProblem, boundary: BoundaryDistance) -> FloatArray | None:
    """The goal's position if it is held, else the one within the tolerance that has the most room."""
    goal, room = problem.goal_pose[:2], problem.position_tolerance
    depth = float(boundary.batch(goal[None])[0])
    if depth > 0.0:
        return goal
    if depth < -room:
        return None
    places = goal + room * _END_FAN
    left = np.minimum(boundary.batch(places), room - np.hypot(*(places - goal).T))
    best = int(np.argmax(left))
    return places[best] if left[best] >= LEAST_END_SHARE * room else None
