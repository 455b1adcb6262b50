"""Proofs of infeasibility, written down such that the exact checker can check them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial, reduce
from itertools import product

import numpy as np
import shapely
from manifold3d import CrossSection
from shapely import Point, Polygon
from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.answers.proof import Cut, InfeasibilityProof, OverCell, OverSlice, Squeeze, Witness
from coop_drake.errors import GeometryError
from coop_drake.geometry.minkowski import FreeSpace, shared, to_polygon
from coop_drake.geometry.polygons import parts_of
from coop_drake.geometry.swept_tree import BodyPair, Interval, Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, Region, regions_of
from coop_drake.planning.cells.graph import Slices
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree

# Witnesses for the exact checker: what bodies cover in a whole slice, where two overlap or are squeezed.

LEAST_LOSS = 1e-7
"""Polygons lose at least this at their corners, far less than what the planner grows cells by [m]."""

LOSS_PER_GROWTH = 0.25
"""Polygons lose this fraction of what cells are grown by; cells still hold all that is not blocked [-]."""


class Witnesses:
    """Makes witnesses for slices of one question.

    Args:
        tree: The whole team, whose pieces are numbered in the order of components, bodies and shapes.
        swept: Sweeps of the pieces that the question keeps.
        maker: Looks for pairs of round pieces between walls, if such positions were left out.
    """

    def __init__(self, tree: ComponentTree, swept: SweptTree, maker: CellMaker | None = None) -> None:
        self._maker = maker
        kept = {component.name for component in swept.tree.components}
        names = [c.name for c in tree.components for body in c.bodies for _ in body.shapes]
        self._numbers = [number for number, name in enumerate(names) if name in kept]
        self._tree, self._swept = tree, swept
        self._sweeps: dict[tuple[object, ...], Witness | None] = {}
        self._owners = [k for k, c in enumerate(tree.components) for body in c.bodies for _ in body.shapes]

    def ends(self, intervals: Intervals) -> tuple[FloatArray, FloatArray]:
        """Ends of a slice of the whole team, shape (1 + n,): other joints move within their ranges."""
        kept = {joint.name: ends for joint, ends in zip(self._swept.tree.joints, intervals[1:], strict=True)}
        return slice_ends(self._tree, intervals[0], kept)

    def overlaps(self, intervals: Intervals) -> tuple[Witness, ...]:
        """A point that two pieces hold all over a slice; none if no pair is known to overlap."""
        pair = self._swept.pairs.overlapping(intervals)
        if pair is None:
            return ()
        depth, pieces, point = max(self._common(pair, intervals), key=lambda common: common[0])
        numbers = tuple(sorted(self._numbers[k] for k in pieces))
        if depth <= 0.0:
            return ()
        common = common_component(self._tree, *(self._owners[number] for number in numbers))
        return (Witness(numbers, common, point[None]),)

    def inner_sweeps(self, intervals: Intervals, growth: float) -> tuple[Witness, ...]:
        """Polygons that pieces cover at every configuration of a slice, without corners that do not matter.

        Args:
            intervals: The slice.
            growth: How far the slice's cells reach beyond the positions that these polygons leave free [m].
        """
        loss = LEAST_LOSS + LOSS_PER_GROWTH * max(growth, 0.0)
        found = [self._inner_sweep(k, intervals, loss) for k in range(len(self._numbers))]
        return tuple(witness for witness in found if witness is not None)

    def _inner_sweep(self, index: int, intervals: Intervals, loss: float) -> Witness | None:
        """The witness of one piece, if any; slices that differ along other axes share it."""
        key = (index, loss, *[intervals[axis] for axis in self._swept.pieces[index].axes])
        if key not in self._sweeps:
            ring = self._swept.under(index, intervals)
            inside = None if ring is None else smaller(ring, loss)
            self._sweeps[key] = None if inside is None else Witness((self._numbers[index],), 0, inside)
        return self._sweeps[key]

    def squeezed(
        self, intervals: Intervals, regions: Sequence[Region], growth: float
    ) -> tuple[tuple[Squeeze, ...], list[Region]]:
        """Pairs of pieces that are squeezed in some of a slice's regions, and the other regions.

        Args:
            intervals: The slice.
            regions: Regions of positions.
            growth: How far the statements hold beyond these regions, about [m].
        """
        if self._maker is None:
            return (), list(regions)
        pairs, rest = self._maker.unsqueezed(intervals, regions, growth)
        found = []
        for pair in pairs:
            numbers = tuple(self._numbers[k] for k in pair.pieces)
            common = common_component(self._tree, *(self._owners[number] for number in numbers))
            cuts = [Cut(k, row[:2], float(row[2])) for k, rows in enumerate(pair.cuts) for row in rows]
            found.append(Squeeze(numbers, common, pair.polygon, tuple(cuts)))
        return tuple(found), rest

    def _common(
        self, pair: BodyPair, intervals: Intervals
    ) -> list[tuple[float, tuple[int, int], FloatArray]]:
        """For pieces of two bodies the area that they share all over a slice, and a point in its middle."""
        found = []
        for i in pair.first:
            for j in pair.second:
                one = self._swept.under(i, intervals, pair.first_stages)
                other = self._swept.under(j, intervals, pair.second_stages)
                if one is not None and other is not None and min(len(one), len(other)) > 2:
                    shared = shapely.intersection(Polygon(one), Polygon(other))
                    point = np.array(shared.centroid.coords[0]) if shared.area > 0.0 else np.zeros(2)
                    found.append((float(shared.area), (i, j), point))
        return found or [(0.0, (0, 0), np.zeros(2))]


def slice_ends(
    tree: ComponentTree, angles: Interval, kept: Mapping[str, Interval]
) -> tuple[FloatArray, FloatArray]:
    """Ends, shape (1 + n,), of angles, of intervals of joints by name, and of the ranges of all others."""
    joints = [kept.get(joint.name, joint.range) for joint in tree.joints]
    lower, upper = np.array([angles, *joints], dtype=float).T
    return lower.copy(), upper.copy()


def common_component(tree: ComponentTree, first: int, second: int) -> int:
    """Index of the nearest component that carries two components."""
    while first != second:  # Parents stand before children.
        later = max(first, second)
        first, second = min(first, second), tree.components[later].parent or 0
    return first


def smaller(ring: FloatArray, loss: float) -> FloatArray | None:
    """A polygon inside a convex one, no further away from any point of it than a loss; None if none is found.

    Half of the loss is used to leave out corners, half to draw the others towards the middle.

    Args:
        ring: Vertices, shape (n, 2) [m].
        loss: The largest distance between the polygons [m].
    """
    polygon = Polygon(ring)
    simple = polygon.simplify(0.5 * loss)
    lost = shapely.distance(simple, shapely.points(ring)).max()  # It may be more where the ring begins.
    if not simple.is_valid or not simple.area > 0.0 or lost > 0.5 * loss:
        simple = polygon
    middle, corners = np.array(simple.centroid.coords[0]), shapely.get_coordinates(simple)[:-1]
    size = float(np.hypot(*(corners - middle).T).max())
    if not polygon.area > 0.0 or size <= loss:
        return None
    drawn: FloatArray = middle + (1.0 - 0.5 * loss / size) * (corners - middle)
    return drawn


# Proofs of infeasibility, written down such that the verifier can check them.

GROWTHS = (1e-3, 1e-4, 1e-5, 0.0, -5e-7)
"""Cells are grown by the first of these that keeps start and goal apart [m]: the more they are grown, the
faster the check. The last one takes back half of the tolerance by which the planner grows cells, for cells
that merely touch."""

TOUCHING = 1e-6
"""Cells nearer to each other than this count as touching, as they do for the verifier [m]."""

LEAST_OVERLAP = 1e-5
"""Squeezed pieces forbid positions at least so far beyond what else is left free [m]: they must overlap."""

FAILURES = ShapelyError, GeometryError, ValueError
"""What failing geometry raises."""


def slices_proof(
    question: PlanningProblem, slices: Slices, regions: Mapping[int, Sequence[Region]], witnesses: Witnesses
) -> InfeasibilityProof | None:
    """Write an exploration's leaves down as a proof.

    Its cells are made of the witnesses, which hold a little less than the pieces do: what is narrow may be
    free for them.

    Args:
        question: The question that was explored, with the kept robots only.
        slices: The subdivision.
        regions: Over-cells of every leaf by its id.
        witnesses: Makes what shows that all else is blocked.

    Returns:
        The proof, or None if it fails because cells almost touch, or because geometry fails.
    """
    leaves = slices.leaves()
    joined = {
        leaf: [other for other in sorted(slices.all[leaf].neighbours) if other > leaf] for leaf in leaves
    }
    starts = set(slices.holding([float(angle) for angle in question.start[2:]]))
    goals = set(slices.meeting(goal_box(question)))

    start, goal, room = Point(question.start[:2]), Point(question.goal_pose[:2]), question.position_tolerance
    floor = Floor(FreeSpace.over(question.workspace))

    def separated(growth: float) -> list[OverSlice] | None:
        shown, cells = dict[int, tuple[Witness, ...]](), dict[int, list[Polygon]]()
        squeezes, beyond = dict[int, tuple[Squeeze, ...]](), max(0.5 * growth, LEAST_OVERLAP)
        for leaf in leaves:
            intervals = slices.all[leaf].intervals
            overlaps = () if regions[leaf] else witnesses.overlaps(intervals)
            shown[leaf] = overlaps or witnesses.inner_sweeps(intervals, growth)
            left = [] if overlaps else floor.not_forbidden(shown[leaf])
            squeezes[leaf], left = witnesses.squeezed(intervals, left, beyond)
            cells[leaf] = _grown(left, growth)
        labels = _reached(cells, joined, start, starts)
        if any(
            label and cell.dwithin(goal, room + TOUCHING)
            for leaf in goals
            for cell, label in zip(cells[leaf], labels[leaf], strict=True)
        ):
            return None
        return [
            OverSlice(
                *witnesses.ends(slices.all[leaf].intervals),
                shown[leaf],
                tuple(map(OverCell, labels[leaf], cells[leaf])),
                squeezes[leaf],
            )
            for leaf in leaves
        ]

    for growth in GROWTHS:
        try:
            parts = separated(growth)
        except FAILURES:
            continue
        if parts is not None:
            return InfeasibilityProof("slices", 0, np.zeros(2), tuple(parts))
    return None


class Floor:
    """Positions on a floor that witnesses leave free; those of a witness that slices share are kept.

    Args:
        space: Where polygons fit.
    """

    def __init__(self, space: FreeSpace) -> None:
        self._space = space
        self._known: dict[bytes, CrossSection] = {}

    def not_forbidden(self, sweeps: Sequence[Witness]) -> list[Region]:
        """Regions of all positions that polygons inside pieces do not forbid.

        Raises:
            GeometryError: There are no polygons: nothing is forbidden.
        """
        if not sweeps:
            raise GeometryError("no piece is known to hold a polygon all over a slice")
        sections = [self._fitting(sweep.polygon) for sweep in sweeps]
        return regions_of(reduce(partial(shared, over=True), sections), over=True)

    def _fitting(self, polygon: FloatArray) -> CrossSection:
        """Positions at which a polygon fits."""
        key = polygon.tobytes()
        if key not in self._known:
            self._known[key] = self._space.minus(polygon)
        return self._known[key]


def _grown(regions: Sequence[Region], growth: float) -> list[Polygon]:
    """Connected parts of some regions grown by a length, in a fixed order."""
    polygons = [shapely.make_valid(to_polygon(region.section)) for region in regions]
    grown = shapely.union_all([polygon.buffer(growth, join_style="mitre") for polygon in polygons])
    parts = [part for part in parts_of(grown) if part.area > 0.0]
    return sorted(parts, key=lambda part: (part.bounds, part.area))


def _reached(
    cells: Mapping[int, Sequence[Polygon]],
    joined: Mapping[int, Sequence[int]],
    start: Point,
    starts: set[int],
) -> dict[int, list[bool]]:
    """For each leaf which of its cells touching cells of neighbouring leaves join to the start.

    Args:
        cells: The cells of every leaf by its id.
        joined: For each leaf those of its neighbours whose id is higher.
        start: Where paths begin.
        starts: Leaves that hold the angles at the start.
    """
    import networkx as nx  # Plans do not need it, and its import takes a tenth of a second.

    numbers = iter(range(sum(map(len, cells.values()))))
    places = {leaf: [next(numbers) for _ in its] for leaf, its in cells.items()}
    polygons = np.array([cell for its in cells.values() for cell in its], dtype=object)
    beside = np.array(
        [
            pair
            for leaf, others in joined.items()
            for other in others
            for pair in product(places[leaf], places[other])
        ],
        dtype=np.int64,
    ).reshape(-1, 2)
    begins = np.array([k for leaf in sorted(starts) for k in places[leaf]], dtype=np.int64)
    first = begins[shapely.dwithin(polygons[begins], start, TOUCHING)].tolist()
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(first)
    one, other = polygons[beside.T]
    graph.add_edges_from(beside[shapely.dwithin(one, other, TOUCHING)].tolist())
    reached = set[int]().union(*(nx.node_connected_component(graph, k) for k in first))
    return {leaf: [k in reached for k in its] for leaf, its in places.items()}
