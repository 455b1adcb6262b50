"""Sweeps of a whole team over a slice, and pairs of its bodies that touch there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coop_drake.geometry.polygons import separated
from coop_drake.geometry.sweeps import (
    TOUCH,
    closed_directions,
    common_disc,
    disc_turn,
    edge_directions,
    normals,
    over_piece,
    under_prismatic,
    under_revolute,
)
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree, ConvexShape, TeamArrays, TreeJoint

# Over- and under-footprints of the team over a compound slice, eq. (6), cached by the ancestors' slices.
#
# A sweep over one joint maps convex sets to convex sets: the over-sweep encloses every placed copy, the
# under-sweep is enclosed by every placed copy. Rigid motions are bijections, so sweeps nest over a product
# of intervals. The verifier has over-sweeps of its own, in ``verification``.

_NUDGE = 1e-6
"""Angle on either side of a direction at which the vertices of an edge are looked for [rad]."""

Interval = tuple[float, float]
Intervals = tuple[Interval, ...]


@dataclass(frozen=True)
class Piece:
    """One convex piece of one body of one component.

    Attributes:
        component: Index of the component.
        body: Index of the body in the component.
        shape: The piece in the component's frame.
        chain: Components from its own to the object's.
        axes: Axes of the slice that move it, its own joint first, theta (axis 0) last.
    """

    component: int
    body: int
    shape: ConvexShape
    chain: tuple[int, ...]
    axes: tuple[int, ...]


class SweptTree:
    """Sweeps of every convex piece of a tree over the intervals of a slice.

    A slice is a tuple of intervals (lower, upper) of the axes (theta, q...) [rad, m].

    Args:
        tree: The team as seen from the object outwards.
    """

    def __init__(self, tree: ComponentTree) -> None:
        self.tree = tree
        pieces = []
        for index, component in enumerate(tree.components):
            chain = tree.ancestors[index]
            joints = [tree.components[i].joint for i in chain]
            axes = (*[1 + joint.index for joint in joints if joint is not None], 0)
            pieces += [
                Piece(index, number, shape, chain, axes)
                for number, body in enumerate(component.bodies)
                for shape in body.shapes
            ]
        self.pieces: tuple[Piece, ...] = tuple(pieces)
        self.arrays: TeamArrays = tree.arrays
        self._over: dict[tuple[object, ...], FloatArray] = {}
        self._under: dict[tuple[object, ...], FloatArray] = {}

    @cached_property
    def pairs(self) -> BodyPairs:
        """Its pairs of bodies that must not touch."""
        return BodyPairs(self)

    def over(self, index: int, intervals: Intervals, stages: int | None = None) -> FloatArray:
        """Polygon that encloses a piece at every configuration of a slice, the object's origin at p_WL = 0.

        Args:
            index: Index into ``pieces``.
            intervals: The slice.
            stages: Number of joints to sweep, counted from the piece's own joint towards the object. None:
                all joints and theta; the result is in W. Fewer: the result is in the frame of the component
                ``chain[stages]``.

        Returns:
            Vertices, counter-clockwise, shape (n, 2) [m].
        """
        axes = self.pieces[index].axes
        count = len(axes) if stages is None else stages
        key = (index, count, *[intervals[axis] for axis in axes[:count]])
        found = self._over.get(key)
        if found is None:
            found = self._over[key] = self._swept(index, intervals, count, rounded=True)
        return found

    def under(self, index: int, intervals: Intervals, stages: int | None = None) -> FloatArray | None:
        """Polygon that a piece covers at every configuration of a slice, or None; see ``over``."""
        piece = self.pieces[index]
        count = len(piece.axes) if stages is None else stages
        if len(piece.shape.vertices) == 1:
            centres = self._swept(index, intervals, count, rounded=False)
            found = common_disc(centres, piece.shape.radius, self._turn(piece, intervals, count))
        else:
            found = self._under_stage(index, intervals, count)
        return found if len(found) else None

    @staticmethod
    def _turn(piece: Piece, intervals: Intervals, stages: int) -> float:
        widths = [intervals[axis][1] - intervals[axis][0] for axis in piece.axes[:stages]]
        return disc_turn(0.5 * max(widths, default=0.0))

    def _swept(self, index: int, intervals: Intervals, count: int, *, rounded: bool) -> FloatArray:
        bounds = np.array(intervals)
        lower, upper = bounds[:, 0].copy(), bounds[:, 1].copy()
        return over_piece(self.arrays, index, lower, upper, count, rounded)

    def _under_stage(self, index: int, intervals: Intervals, count: int) -> FloatArray:
        """The under-sweep over the first joints of a piece; no rows if it is empty."""
        piece = self.pieces[index]
        key = (index, count, *[intervals[axis] for axis in piece.axes[:count]])
        if key not in self._under:
            self._under[key] = self._make_under(piece, index, intervals, count)
        return self._under[key]

    def _make_under(self, piece: Piece, index: int, intervals: Intervals, count: int) -> FloatArray:
        if count == 0:
            shape = piece.shape
            if shape.radius == 0.0:
                return shape.vertices if len(shape.vertices) > 2 else np.empty((0, 2))
            return inscribed(shape.vertices, shape.radius, self._turn(piece, intervals, len(piece.axes)))
        inner = self._under_stage(index, intervals, count - 1)
        if not len(inner):
            return inner
        joint = self.tree.components[piece.chain[count - 1]].joint
        interval = intervals[piece.axes[count - 1]]
        if joint is None or joint.kind == "revolute":
            swept = under_revolute(inner, *_turning(joint, interval))
        else:
            swept = under_prismatic(inner, *_sliding(joint, interval))
        return swept if joint is None or not len(swept) else joint.X_PJ.apply(swept)


def _turning(joint: TreeJoint | None, interval: Interval) -> tuple[float, float]:
    """Centre and half-width of the turn that an interval of a revolute joint (or of theta) stands for."""
    sign = 1.0 if joint is None else joint.sign
    return sign * 0.5 * (interval[0] + interval[1]), 0.5 * (interval[1] - interval[0])


def _sliding(joint: TreeJoint, interval: Interval) -> tuple[float, float, float, float]:
    """Displacements in J, (x, y) each, at both ends of an interval of a prismatic joint."""
    (x, y), (lower, upper) = joint.axis, interval
    return x * lower, y * lower, x * upper, y * upper


def inscribed(vertices: FloatArray, radius: float, largest_turn: float) -> FloatArray:
    """Polygon inside a convex set grown by a radius: its vertices lie on arcs about the set's vertices."""
    directions = closed_directions(edge_directions(vertices), largest_turn)
    before, after = (
        np.argmax(normals(directions + nudge) @ vertices.T, axis=1) for nudge in (-_NUDGE, _NUDGE)
    )
    corners = vertices[np.stack((before, after), axis=1)]
    ring = (corners + radius * normals(directions)[:, None, :]).reshape(-1, 2)
    distinct: FloatArray = ring[np.abs(ring - np.roll(ring, 1, axis=0)).max(axis=1) > 1e-9]
    return distinct


# Collisions among object, arms and bases: pairs of bodies over a slice, which eq. (4) leaves out.


@dataclass(frozen=True)
class BodyPair:
    """Two bodies that must never overlap.

    Attributes:
        first: Pieces of the first body, indices into ``SweptTree.pieces``.
        second: Pieces of the second body.
        first_stages: Number of joints between the first body and the nearest component that carries both.
        second_stages: Number of joints between the second body and that component.
        axes: Axes of the slice that move one body against the other; theta is never among them.
    """

    first: tuple[int, ...]
    second: tuple[int, ...]
    first_stages: int
    second_stages: int
    axes: tuple[int, ...]


class BodyPairs:
    """Conservative answers about all of ``ComponentTree.collision_pairs``, cached by the joints between.

    Attributes:
        pairs: All pairs of bodies.
    """

    def __init__(self, swept: SweptTree) -> None:
        self._swept = swept
        self.pairs = tuple(self._pair(a, b) for a, b in swept.tree.collision_pairs)
        self._touch: dict[tuple[object, ...], bool] = {}
        self._overlap: dict[tuple[object, ...], bool] = {}

    def touching(self, intervals: Intervals) -> BodyPair | None:
        """First pair that may touch somewhere in the slice; None proves the whole slice free of contact."""
        return self._first(self._may_touch, self._touch, intervals)

    def overlapping(self, intervals: Intervals) -> BodyPair | None:
        """First pair that overlaps all over the slice: proves that no configuration in it is free."""
        return self._first(self._must_overlap, self._overlap, intervals)

    def _first(
        self,
        test: Callable[[BodyPair, Intervals], bool],
        known: dict[tuple[object, ...], bool],
        intervals: Intervals,
    ) -> BodyPair | None:
        """First pair that passes a test; results are cached by the intervals that move the pair."""
        for number, pair in enumerate(self.pairs):
            key = (number, *[intervals[axis] for axis in pair.axes])
            if key not in known:
                known[key] = test(pair, intervals)
            if known[key]:
                return pair
        return None

    def _may_touch(self, pair: BodyPair, intervals: Intervals) -> bool:
        others = [self._swept.over(j, intervals, pair.second_stages) for j in pair.second]
        return any(
            not separated(self._swept.over(i, intervals, pair.first_stages), other, TOUCH)
            for i in pair.first
            for other in others
        )

    def _must_overlap(self, pair: BodyPair, intervals: Intervals) -> bool:
        others = [self._swept.under(j, intervals, pair.second_stages) for j in pair.second]
        for i in pair.first:
            piece = self._swept.under(i, intervals, pair.first_stages)
            if piece is not None and any(o is not None and not separated(piece, o, -TOUCH) for o in others):
                return True
        return False

    def _pair(self, first: tuple[int, int], second: tuple[int, int]) -> BodyPair:
        tree, stages = self._swept.tree, self._swept.tree.stages_between(first[0], second[0])
        members = [
            tuple(n for n, piece in enumerate(self._swept.pieces) if (piece.component, piece.body) == body)
            for body in (first, second)
        ]
        axes = [
            1 + joint.index
            for (component, _), count in zip((first, second), stages, strict=True)
            for joint in (tree.components[i].joint for i in tree.ancestors[component][:count])
            if joint is not None
        ]
        return BodyPair(members[0], members[1], *stages, tuple(sorted(axes)))
