"""Hypothesis strategies: random teams, non-convex, revolute and prismatic, and slices of them."""

from __future__ import annotations

from math import pi

import numpy as np
from hypothesis import strategies as st
from shapely import MultiPoint, Polygon, union_all
from shapely.geometry.base import BaseGeometry

from coop_drake.geometry.pose import PlanarPose
from coop_drake.geometry.tree import Body, Component, ComponentTree, ConvexShape, TreeJoint
from tests.support.cases import disc, rectangle

SHAPES = (
    (rectangle(0.0, 0.5, -0.1, 0.1),),
    (rectangle(0.0, 0.4, -0.05, 0.05), rectangle(0.3, 0.4, -0.3, 0.05)),
    (disc(0.25, 0.3),),
    (ConvexShape(np.array([[0.0, 0.0], [0.3, 0.1]]), 0.08),),
    (ConvexShape(np.array([[-0.1, -0.1], [0.3, -0.05], [0.2, 0.2]]), 0.05), disc(0.1, -0.1, 0.1)),
)


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
def trees(draw: st.DrawFn, robots: tuple[int, int] = (1, 3)) -> ComponentTree:
    """A team of one to three robots with one or two joints each, in any pose about the object."""
    number = st.floats(-0.4, 0.4)
    turn = st.floats(-pi, pi)
    count = draw(st.integers(*robots))
    components = [Component("object", None, None, (Body("object", None, draw(st.sampled_from(SHAPES))),))]
    sharing: set[tuple[str, str]] = set()
    joints = 0
    for robot in range(count):
        parent, above = 0, "object"
        for stage in range(draw(st.integers(1, 2))):
            name = f"robot_{robot}::link_{stage}"
            X_PJ = PlanarPose(draw(number), draw(number), draw(turn))
            kind = draw(st.sampled_from(("revolute", "prismatic")))
            axis = (draw(st.sampled_from((1.0, -0.5, 0.0))), draw(st.sampled_from((0.3, 1.0))))
            sign = draw(st.sampled_from((1.0, -1.0)))
            limit = 1.9 if kind == "revolute" else 0.4
            joint = TreeJoint(f"{name}_joint", kind, robot, joints, X_PJ, sign, axis, -limit, limit)
            body = Body(name, robot, draw(st.sampled_from(SHAPES)))
            components.append(Component(name, parent, joint, (body,)))
            sharing.add((name, above))
            parent, above, joints = len(components) - 1, name, joints + 1
    return ComponentTree(tuple(components), frozenset(sharing))


@st.composite
def slices_of(draw: st.DrawFn, tree: ComponentTree) -> tuple[tuple[float, float], ...]:
    """A compound slice inside the joints' limits, from a single configuration to wide ones."""
    widest = draw(st.sampled_from((0.0, 0.02, 0.2, 0.8, 3.0)))
    intervals = [(-pi, pi), *[(joint.lower, joint.upper) for joint in tree.joints]]
    result = []
    for lower, upper in intervals:
        width = min(widest, upper - lower) * draw(st.floats(0.0, 1.0))
        start = lower + (upper - lower - width) * draw(st.floats(0.0, 1.0))
        result.append((float(start), float(start + width)))
    return tuple(result)


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
