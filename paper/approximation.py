"""The paper's Figure 3: a system of two components, its over- and its under-approximations, eq. (6)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import cos, pi

import numpy as np
from shapely import MultiPoint, Polygon, union_all
from shapely.geometry.base import BaseGeometry

from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree

__all__ = ["Approximation", "approximations", "two_components"]

_PER_AXIS = 9
"""Number of configurations of a slice that are compared along every axis."""

_ARC = 256
"""Number of segments of a quarter of a circle in exact footprints."""


@dataclass(frozen=True)
class Approximation:
    """The over- and the under-approximation (6) of the footprint in a slice, at p_WL = 0.

    Attributes:
        intervals: The slice: intervals of (theta, q) [rad].
        over: Encloses the footprint at every configuration of the slice [m].
        under: Is covered at every one of them [m].
        exact: Footprints at some of them [m].
        rounding: Largest distance by which discs among ``exact`` are smaller than they should be [m].
    """

    intervals: Intervals
    over: BaseGeometry
    under: BaseGeometry
    exact: tuple[BaseGeometry, ...]
    rounding: float

    @property
    def encloses(self) -> bool:
        """Whether every exact footprint contains ``under`` and lies in ``over``."""
        return all(
            shape.buffer(self.rounding).covers(self.under) and self.over.buffer(self.rounding).covers(shape)
            for shape in self.exact
        )

    @property
    def gap(self) -> float:
        """Area of the over-approximation minus that of the under-approximation [m^2]."""
        return float(self.over.area - self.under.area)


def two_components(tree: ComponentTree) -> ComponentTree:
    """Return a tree of two components: the object with what is welded to it, and what one joint moves.

    Args:
        tree: A team of robots with a joint each.
    """
    moved = next(component for component in tree.components if component.parent == 0)
    assert moved.joint is not None
    robot = moved.joint.robot
    carried = tuple(body for body in tree.components[0].bodies if body.robot in (None, robot))
    joint = replace(moved.joint, index=0)
    return ComponentTree(
        (replace(tree.components[0], bodies=carried), replace(moved, joint=joint)), tree.unchecked_pairs
    )


def approximations(tree: ComponentTree, slices: Sequence[Intervals]) -> tuple[Approximation, ...]:
    """Approximate a system over some slices.

    Args:
        tree: The system.
        slices: Intervals of (theta, q...), one after the other.
    """
    swept = SweptTree(tree)
    radii = [s.radius for component in tree.components for body in component.bodies for s in body.shapes]
    rounding = max(radii) * (1.0 - cos(0.25 * pi / _ARC)) + 1e-9
    return tuple(_approximation(swept, intervals, rounding) for intervals in slices)


def _approximation(swept: SweptTree, intervals: Intervals, rounding: float) -> Approximation:
    pieces = range(len(swept.pieces))
    common = [swept.under(index, intervals) for index in pieces]
    return Approximation(
        intervals=intervals,
        over=union_all([Polygon(swept.over(index, intervals)) for index in pieces]),
        under=union_all([Polygon(ring) for ring in common if ring is not None]),
        exact=tuple(_footprint(swept.tree, axes) for axes in _configurations(intervals)),
        rounding=rounding,
    )


def _configurations(intervals: Intervals) -> Iterator[FloatArray]:
    """Yield configurations spread evenly over a slice, its corners included, shape (1 + n,)."""
    ends = [sorted(set(np.linspace(lower, upper, _PER_AXIS))) for lower, upper in intervals]
    for axes in product(*ends):
        yield np.array(axes)


def _footprint(tree: ComponentTree, axes: FloatArray) -> BaseGeometry:
    placed = zip(tree.components, tree.poses(np.concatenate([[0.0, 0.0], axes])), strict=True)
    return union_all(
        [
            MultiPoint(X_WC.apply(np.atleast_2d(shape.vertices))).convex_hull.buffer(shape.radius, _ARC)
            for component, X_WC in placed
            for body in component.bodies
            for shape in body.shapes
        ]
    )
