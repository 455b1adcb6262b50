"""Hypothesis strategies: random teams, non-convex, revolute and prismatic, and slices of them."""

from __future__ import annotations

from math import inf, pi

import numpy as np
from hypothesis import strategies as st
from shapely import MultiPoint, Polygon, union_all
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint
from tests.support.cases import disc, rectangle

SHAPES = (
    (rectangle(0.0, 0.5, -0.1, 0.1),),
    (rectangle(0.0, 0.4, -0.05, 0.05), rectangle(0.3, 0.4, -0.3, 0.05)),
    (disc(0.25, 0.3),),
    (ConvexShape(np.array([[0.0, 0.0], [0.3, 0.1]]), 0.08),),
    (ConvexShape(np.array([[-0.1, -0.1], [0.3, -0.05], [0.2, 0.2]]), 0.05), disc(0.1, -0.1, 0.1)),
    (rectangle(-0.2, 0.2, -0.2, -0.15), rectangle(-0.2, -0.15, -0.2, 0.2), rectangle(0.15, 0.2, -0.2, 0.2)),
    (ConvexShape(np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.001]])), disc(0.01, 0.4, 0.0)),
)


def scaled(shape: ConvexShape, factor: float) -> ConvexShape:
    """The same shape larger or smaller about its component's origin."""
    return ConvexShape(factor * shape.vertices, factor * shape.radius)


def placed_shape(shape: ConvexShape, X_WC: PlanarPose, quad_segs: int = 32) -> BaseGeometry:
    """One piece in W; arcs are inscribed polygons, so the result never exceeds the piece."""
    return MultiPoint(X_WC.apply(shape.vertices)).convex_hull.buffer(shape.radius, quad_segs=quad_segs)


def footprint(tree: ComponentTree, z: np.ndarray) -> BaseGeometry:
    """Exact footprint, eq. (3), up to inscribed arcs."""
    return union_all(
        [
            placed_shape(shape, X_WC)
            for component, X_WC in zip(tree.components, tree.poses(z), strict=True)
            for body in component.bodies
            for shape in body.shapes
        ]
    )


def body_footprints(tree: ComponentTree, z: np.ndarray) -> dict[tuple[int, int], BaseGeometry]:
    """Exact footprint of every body by (component, body)."""
    poses = tree.poses(z)
    return {
        (c, b): union_all([placed_shape(shape, poses[c]) for shape in body.shapes])
        for c, component in enumerate(tree.components)
        for b, body in enumerate(component.bodies)
    }


@st.composite
def trees(
    draw: st.DrawFn, robots: tuple[int, int] = (1, 4), joints: tuple[int, int] = (1, 3)
) -> ComponentTree:
    """A team of one to four robots with one to three joints each, in any pose about the object."""
    count = draw(st.integers(*robots))
    components = [Component("object", None, None, (Body("object", None, draw(st.sampled_from(SHAPES))),))]
    sharing: set[tuple[str, str]] = set()
    for robot in range(count):
        parent, above = 0, "object"
        for stage in range(draw(st.integers(*joints))):
            name = f"robot_{robot}::link_{stage}"
            X_PJ = draw(_poses(2.0 * pi * robot / count if stage == 0 else 0.0))
            joint = draw(_joints(f"{name}_joint", robot, len(components) - 1, X_PJ))
            size = draw(st.sampled_from((0.2, 0.5, 1.0)))
            bodies = [
                Body(name, robot, tuple(scaled(shape, size) for shape in draw(st.sampled_from(SHAPES))))
            ]
            if draw(st.booleans()):
                bodies.append(Body(f"{name}_welded", robot, (disc(0.1, 0.2, 0.3 * size),)))
            components.append(Component(name, parent, joint, tuple(bodies)))
            sharing.add((name, above))
            parent, above = len(components) - 1, name
    return ComponentTree(tuple(components), frozenset(sharing))


_OFFSETS = st.floats(-0.4, 0.4)


@st.composite
def _poses(draw: st.DrawFn, bearing: float) -> PlanarPose:
    """Where a joint's frame lies on its parent: mostly outwards, so that arms are apart, or anywhere."""
    if draw(st.integers(0, 3)) == 0:
        return PlanarPose(draw(_OFFSETS), draw(_OFFSETS), draw(st.floats(-pi, pi)))
    outwards = PlanarPose(0.0, 0.0, bearing) @ PlanarPose(draw(st.floats(0.3, 0.7)), draw(_OFFSETS))
    return outwards @ PlanarPose(0.0, 0.0, draw(st.floats(-0.5, 0.5)))


@st.composite
def _joints(draw: st.DrawFn, name: str, robot: int, index: int, X_PJ: PlanarPose) -> TreeJoint:
    """A joint of either kind whose range holds zero."""
    kind = draw(st.sampled_from(("revolute", "prismatic")))
    axis = (draw(st.sampled_from((1.0, -0.5, 0.0))), draw(st.sampled_from((0.3, 1.0))))
    sign = draw(st.sampled_from((1.0, -1.0)))
    limits = (
        draw(st.sampled_from(((-1.9, 1.9), (-pi, pi), (0.0, 2.8), (-inf, inf))))
        if kind == "revolute"
        else (-0.4, 0.4)
    )
    return TreeJoint(name, kind, robot, index, X_PJ, sign, axis, *limits)


@st.composite
def slices_of(draw: st.DrawFn, tree: ComponentTree) -> tuple[tuple[float, float], ...]:
    """A compound slice inside the joints' limits, from a single configuration to the whole circle.

    Half of them are as halving makes them: their ends are round, and sides of swept bodies become parallel.
    """
    limits = [(-0.25 * pi, 1.75 * pi), *[joint.range for joint in tree.joints]]
    if draw(st.booleans()):
        return tuple(_halved(*ends, draw(st.integers(0, 10)), draw(st.floats(0.0, 0.999))) for ends in limits)
    widest = draw(st.sampled_from((0.0, 1e-4, 0.02, 0.2, 0.8, 3.0, 2.0 * pi)))
    result = []
    for lower, upper in limits:
        width = min(widest, upper - lower) * draw(st.floats(0.0, 1.0))
        start = lower + (upper - lower - width) * draw(st.floats(0.0, 1.0))
        result.append((float(start), float(start + width)))
    return tuple(result)


def _halved(lower: float, upper: float, times: int, share: float) -> tuple[float, float]:
    """The interval that holds a share of another one after so many halvings."""
    for _ in range(times):
        middle = 0.5 * (lower + upper)
        if share < 0.5:
            upper, share = middle, 2.0 * share
        else:
            lower, share = middle, 2.0 * share - 1.0
    return lower, upper


def configurations(
    intervals: tuple[tuple[float, float], ...],
    seed: int,
    count: int,
    position: tuple[float, float] = (0.0, 0.0),
) -> np.ndarray:
    """Configurations of a slice at one position: its corners, then random, shape (count, 3 + n)."""
    random = np.random.default_rng(seed)
    lower, upper = (np.array(ends) for ends in zip(*intervals, strict=True))
    share = random.random((count, len(lower)))
    share[: count // 2] = np.rint(share[: count // 2])
    angles = lower + share * (upper - lower)
    return np.column_stack((np.tile(position, (count, 1)), angles))


def room() -> Polygon:
    """A non-convex floor with two holes, for teams of about a metre."""
    outer = [(-3, -3), (3, -3), (3, 0.5), (1.8, 0.5), (1.8, 3), (-3, 2.5)]
    holes = [[(-2, -2), (-1.2, -2), (-1.6, -1.2)], [(0.9, -1.0), (1.4, -1.0), (1.4, -0.5), (0.9, -0.5)]]
    return Polygon(outer, holes)
