"""Witnesses for the exact checker: what bodies cover in a whole slice, where two overlap or are squeezed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.answers.proof import Cut, Squeeze, Witness
from coop_drake.geometry.body_pairs import BodyPair, BodyPairs
from coop_drake.geometry.swept_tree import Interval, Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray

LEAST_LOSS = 1e-7
"""Polygons lose at least this at their corners, far less than what the planner grows cells by [m]."""

LOSS_PER_GROWTH = 0.25
"""Polygons lose this fraction of what cells are grown by; cells still hold all that is not blocked [-]."""


class Witnesses:
    """Makes witnesses for slices of one question.

    Args:
        tree: The whole team, whose pieces are numbered in the order of components, bodies and shapes.
        swept: Sweeps of the pieces that the question keeps.
        pairs: Pairs of bodies among them.
        maker: Looks for pairs of round pieces between walls, if such positions were left out.
    """

    def __init__(
        self, tree: ComponentTree, swept: SweptTree, pairs: BodyPairs, maker: CellMaker | None = None
    ) -> None:
        self._maker = maker
        kept = {component.name for component in swept.tree.components}
        names = [c.name for c in tree.components for body in c.bodies for _ in body.shapes]
        self._numbers = [number for number, name in enumerate(names) if name in kept]
        self._tree, self._swept, self._pairs = tree, swept, pairs
        self._sweeps: dict[tuple[object, ...], Witness | None] = {}
        self._owners = [k for k, c in enumerate(tree.components) for body in c.bodies for _ in body.shapes]

    def ends(self, intervals: Intervals) -> tuple[FloatArray, FloatArray]:
        """Ends of a slice of the whole team, shape (1 + n,): other joints move within their ranges."""
        kept = {joint.name: ends for joint, ends in zip(self._swept.tree.joints, intervals[1:], strict=True)}
        return slice_ends(self._tree, intervals[0], kept)

    def overlaps(self, intervals: Intervals) -> tuple[Witness, ...]:
        """A point that two pieces hold all over a slice; none if no pair is known to overlap."""
        pair = self._pairs.overlapping(intervals)
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
