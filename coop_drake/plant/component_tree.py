"""The component tree of a team, its shapes being the shadows of its bodies on the floor."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import shapely
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    Mesh,
    SceneGraphInspector,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import Joint, RigidBody
from pydrake.systems.framework import Context
from shapely import MultiPoint, Polygon, box
from shapely.geometry.base import BaseGeometry

from coop_drake.plant.chain import axis_in_world, limits_of, scoped
from coop_drake.plant.parsing import bodies_of, refusal
from coop_drake.plant.team import TeamPlant
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint

_FEW = 16
"""Footprints with at most this many corners are not simplified."""

_GROWTH = 0.003
"""Largest growth of a footprint where corners are removed [m]."""


def enclosed_in_fewer(points: FloatArray) -> FloatArray:
    """Corners of a convex polygon that encloses another, and reaches no more than 3 mm beyond it.

    Shapes (n, 2) [m]; fewer corners if the polygon given has many, otherwise its own.
    """
    from coop_drake.geometry.simplify import simplify_inward

    if len(points) <= _FEW:
        return points
    inner = Polygon(points)
    around = box(*inner.buffer(1.0).bounds)
    (hole,) = simplify_inward(Polygon(around.exterior, [inner.exterior]), _GROWTH).interiors
    outer = Polygon(hole).convex_hull
    if not outer.buffer(1e-9).covers(inner):
        return points
    return shapely.get_coordinates(shapely.orient_polygons(outer))[:-1]


def without_covered(bodies: tuple[Body, ...], may_overlap: frozenset[tuple[str, str]]) -> tuple[Body, ...]:
    """Remove the shapes of a component that a shape of another body of the same robot covers.

    A shape can be removed if everything that would collide with it also collides with the other one: the
    other body must not be exempt from a collision that the shape's own body is not exempt from.

    Args:
        bodies: Bodies that are rigid with each other, in the component's frame.
        may_overlap: Pairs of bodies that are never checked against each other.

    Returns:
        The same bodies in the same order, some with fewer shapes, or none.
    """
    exempt: dict[str, set[str]] = {body.name: set() for body in bodies}
    for first, second in may_overlap:
        exempt.setdefault(first, set()).add(second)
        exempt.setdefault(second, set()).add(first)
    every = [(body, shape) for body in bodies for shape in body.shapes]
    sizes = [_core(shape).buffer(shape.radius).area for _, shape in every]
    largest_first = sorted(range(len(every)), key=lambda place: -sizes[place])
    kept: list[int] = []
    for place in largest_first:
        body, shape = every[place]
        if not any(
            other.robot == body.robot
            and exempt[other.name] - {body.name} <= exempt[body.name]
            and _covers(larger, shape)
            for other, larger in (every[index] for index in kept)
        ):
            kept.append(place)
    left = {id(every[place][1]) for place in kept}
    return tuple(
        Body(body.name, body.robot, tuple(shape for shape in body.shapes if id(shape) in left))
        for body in bodies
    )


def _core(shape: ConvexShape) -> BaseGeometry:
    return MultiPoint(shape.vertices).convex_hull


def _covers(larger: ConvexShape, shape: ConvexShape) -> bool:
    """Whether a convex shape contains another, which its corners decide."""
    corners = shapely.points(shape.vertices)
    return bool(np.all(shapely.distance(corners, _core(larger)) <= larger.radius - shape.radius))


# Projects collision shapes to the floor; a footprint is a convex hull enlarged by a radius.


SUPPORTS = 64
"""Tangent lines that enclose a curved outline: the polygon exceeds it by at most 0.13 % of its radius."""

DIGITS = 12
"""Decimals of a metre that are kept; the rest is rounding of rotations in the files."""

_FLAT = 1e-9
"""Smallest horizontal part of a unit axis that is not taken for rounding [-]."""
_THIN = 1e-6
"""Radius that a footprint without an area gets [m]."""


def project(shape: Shape, X_CG: RigidTransform) -> ConvexShape:
    """Project a collision shape to the plane.

    Footprints of spheres, capsules, boxes, hulls and upright or lying cylinders are exact. Ellipsoids and
    tilted cylinders are enclosed by ``SUPPORTS`` tangents. A mesh counts as its convex hull, as in Drake's
    proximity queries; a hull of many corners is enclosed by one of fewer, at most 3 mm larger.

    Args:
        shape: The shape in its geometry frame G.
        X_CG: Pose of G in a frame C whose z axis is vertical.

    Returns:
        The footprint in C.

    Raises:
        TypeError: The shape has no bounded footprint, for example a half-space.
    """
    centre = X_CG.translation()[:2]
    R = X_CG.rotation().matrix()
    match shape:
        case Sphere():
            return ConvexShape(centre[None, :].round(DIGITS), shape.radius())
        case Capsule():
            arm = 0.5 * shape.length() * R[:2, 2]
            return _capsule(centre, arm, shape.radius())
        case Cylinder():
            return _cylinder(centre, R[:, 2], shape.radius(), 0.5 * shape.length())
        case Ellipsoid():
            return _ellipsoid(centre, R[:2] * np.array([shape.a(), shape.b(), shape.c()]))
        case Box():
            corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
            return hull(centre + (corners * shape.size()) @ R[:2].T)
        case Convex() | Mesh():
            solid = shape.GetConvexHull()
            points = np.array([solid.vertex(i) for i in range(solid.num_vertices())])
            shadow = hull(centre + points @ R[:2].T)
            return ConvexShape(enclosed_in_fewer(shadow.vertices), shadow.radius)
    raise TypeError(f"{type(shape).__name__} has no bounded footprint")


def hull(points: FloatArray) -> ConvexShape:
    """Convex hull of points in the plane, shape (n, 2) [m]; a flat hull gets a micrometre of thickness."""
    outline = MultiPoint(points.round(DIGITS)).convex_hull
    if not isinstance(outline, Polygon):
        ends = np.array(outline.coords)
        return ConvexShape(ends, _THIN)
    ring = np.array(outline.exterior.coords)[:-1]
    return ConvexShape(ring if outline.exterior.is_ccw else ring[::-1].copy())


def _capsule(centre: FloatArray, arm: FloatArray, radius: float) -> ConvexShape:
    if np.hypot(*arm) <= _FLAT:
        return ConvexShape(centre[None, :].round(DIGITS), radius)
    return ConvexShape(np.array([centre - arm, centre + arm]).round(DIGITS), radius)


def _cylinder(centre: FloatArray, axis: FloatArray, radius: float, half_length: float) -> ConvexShape:
    """Support along n: the disc's rim gives r sqrt(1 - (a.n)^2), the axis h |a.n|."""
    if np.hypot(axis[0], axis[1]) <= _FLAT:
        return ConvexShape(centre[None, :].round(DIGITS), radius)
    along = np.arctan2(axis[1], axis[0])
    angles = along + 2.0 * pi * np.arange(SUPPORTS) / SUPPORTS
    share = np.cos(angles) * axis[0] + np.sin(angles) * axis[1]
    support = radius * np.sqrt(np.maximum(0.0, 1.0 - share**2)) + half_length * np.abs(share)
    return hull(centre + _tangent_corners(angles, support))


def _ellipsoid(centre: FloatArray, shadow: FloatArray) -> ConvexShape:
    """Support along n: |shadow^T n|, with shadow the projected semi-axes as columns, shape (2, 3)."""
    squares = np.linalg.eigvalsh(shadow @ shadow.T)
    if squares[1] - squares[0] <= _FLAT * squares[1]:
        return ConvexShape(centre[None, :].round(DIGITS), float(np.sqrt(squares[1])))
    angles = 2.0 * pi * np.arange(SUPPORTS) / SUPPORTS
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    return hull(centre + _tangent_corners(angles, np.linalg.norm(normals @ shadow, axis=1)))


def _tangent_corners(angles: FloatArray, support: FloatArray) -> FloatArray:
    """Corners between neighbouring tangent lines n(angle) . x = support, shape (n, 2)."""
    step = 2.0 * pi / len(angles)
    following = np.roll(support, -1)
    across = (following - support * cos(step)) / sin(step)
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    tangents = np.column_stack([-np.sin(angles), np.cos(angles)])
    return support[:, None] * normals + across[:, None] * tangents


# Reads the component tree, eq. (3), from the team's plant: bodies, joints and collision geometry.


_LARGEST = 1e4
"""Largest distance of a footprint from its joint; more is taken for an error in the file [m]."""


def read_component_tree(team: TeamPlant) -> ComponentTree:
    """Read footprints and joints of the team, as the planner needs them.

    Bodies that are welded together make one component; the object's comes first. The frame C of a component
    stands at its joint, parallel to L when every joint is zero. Joints lead from the object outwards: a joint
    that leads from base to end effector in its file has sign = -1. Bodies without visual and collision
    geometry are left out.

    Raises:
        ScenarioError: A body with visual but no collision geometry, or a shape without a bounded footprint.
    """
    return _TreeReader(team).tree()


class _TreeReader:
    """Reads the plant from the object outwards, with all positions zero."""

    def __init__(self, team: TeamPlant) -> None:
        self.team = team
        self.plant = team.plant
        self.inspector: SceneGraphInspector = team.scene_graph.model_inspector()
        self.context: Context = self.plant.CreateDefaultContext()
        self.plant.SetPositions(self.context, np.zeros(self.plant.num_positions()))
        self.may_overlap = self._may_overlap()
        self.robot_of = {
            int(body.index()): robot.index
            for robot, models in zip(team.robots, team.assembly.robots, strict=True)
            for body in bodies_of(self.plant, models.models)
        }

    def tree(self) -> ComponentTree:
        """Components breadth first, robots in order, and the pairs of bodies that may overlap."""
        root = self._welded_to(self.team.object_body)
        queue = [(root, RigidTransform())]
        components = [self._component(root, None, None, RigidTransform())]
        used: set[int] = set()
        for at, (members, X_WP) in enumerate(queue):  # the queue grows in the loop
            known = {int(body.index()) for body in members}
            for index, joint in enumerate(self.team.joints):
                ends = joint.parent_body(), joint.child_body()
                inside = [int(end.index()) in known for end in ends]
                if index not in used and any(inside):
                    used.add(index)
                    bodies = self._welded_to(ends[1] if inside[0] else ends[0])
                    origin = joint.frame_on_parent().CalcPoseInWorld(self.context).translation()
                    X_WC = RigidTransform(RotationMatrix(), origin)
                    tree_joint = self._tree_joint(joint, index, X_WP, X_WC, outwards=inside[0])
                    queue.append((bodies, X_WC))
                    components.append(self._component(bodies, at, tree_joint, X_WC))
        self._check_solid(components)
        return ComponentTree(tuple(components), self.may_overlap)

    def _check_solid(self, components: list[Component]) -> None:
        """Refuse a robot or an object without any collision geometry."""
        solid = {body.robot for component in components for body in component.bodies}
        for robot, models in enumerate(self.team.assembly.robots):
            if robot not in solid:
                raise refusal(self.team.scenario, models, models.name, "a robot with collision geometry")
        if None not in solid:
            name = self.team.assembly.object_model
            raise refusal(self.team.scenario, None, name, "an object with collision geometry")

    def _welded_to(self, body: RigidBody) -> tuple[RigidBody, ...]:
        """All bodies welded to one, itself included: the object's bodies first, then in the plant's order."""
        welded = self.plant.GetBodiesWeldedTo(body)
        return tuple(sorted(welded, key=lambda b: (self.robot_of.get(int(b.index()), -1), int(b.index()))))

    def _tree_joint(
        self, joint: Joint, index: int, X_WP: RigidTransform, X_WC: RigidTransform, *, outwards: bool
    ) -> TreeJoint:
        axis = axis_in_world(joint, self.context) * (1.0 if outwards else -1.0)
        lower, upper = limits_of(joint)
        offset = X_WC.translation() - X_WP.translation()
        revolute = joint.type_name() == "revolute"
        return TreeJoint(
            name=scoped(self.plant, joint),
            kind="revolute" if revolute else "prismatic",
            robot=self.robot_of[int(joint.child_body().index())],
            index=index,
            X_PJ=PlanarPose(round(float(offset[0]), DIGITS), round(float(offset[1]), DIGITS), 0.0),
            sign=float(np.sign(axis[2])) if revolute else 1.0,
            axis=(0.0, 0.0) if revolute else (round(float(axis[0]), DIGITS), round(float(axis[1]), DIGITS)),
            lower=lower,
            upper=upper,
        )

    def _component(
        self, bodies: tuple[RigidBody, ...], parent: int | None, joint: TreeJoint | None, X_WC: RigidTransform
    ) -> Component:
        X_CW = X_WC.inverse()
        footprints = tuple(
            Body(scoped(self.plant, body), self.robot_of.get(int(body.index())), self._shapes(body, X_CW))
            for body in bodies
        )
        solid = tuple(body for body in without_covered(footprints, self.may_overlap) if body.shapes)
        return Component(footprints[0].name, parent, joint, solid)

    def _shapes(self, body: RigidBody, X_CW: RigidTransform) -> tuple[ConvexShape, ...]:
        X_CB = X_CW @ body.EvalPoseInWorld(self.context)
        geometries = self.plant.GetCollisionGeometriesForBody(body)
        if not geometries and self.plant.GetVisualGeometriesForBody(body):
            raise self._refusal(body, "bodies with collision geometry (this one has visual geometry only)")
        shapes = []
        for geometry in geometries:
            try:
                X_BG = self.inspector.GetPoseInFrame(geometry)
                shapes.append(_checked(project(self.inspector.GetShape(geometry), X_CB @ X_BG)))
            except (TypeError, RuntimeError) as error:
                raise self._refusal(body, f"collision shapes with a bounded footprint ({error})") from error
        return tuple(shapes)

    def _refusal(self, body: RigidBody, allowed: str) -> Exception:
        robot = self.robot_of.get(int(body.index()))
        assembly = None if robot is None else self.team.assembly.robots[robot]
        return refusal(self.team.scenario, assembly, scoped(self.plant, body), allowed)

    def _may_overlap(self) -> frozenset[tuple[str, str]]:
        """Pairs that a movable joint connects, and pairs that the files exempt by collision filter groups."""
        pairs = {
            (scoped(self.plant, joint.parent_body()), scoped(self.plant, joint.child_body()))
            for joint in self.team.joints
        }
        models = [self.team.assembly.object_model, *(m for r in self.team.assembly.robots for m in r.models)]
        geometries = [
            (scoped(self.plant, body), self.plant.GetCollisionGeometriesForBody(body))
            for body in bodies_of(self.plant, models)
        ]
        for place, (first, ours) in enumerate(geometries):
            for second, theirs in geometries[place + 1 :]:
                filtered = (self.inspector.CollisionFiltered(a, b) for a in ours for b in theirs)
                if ours and theirs and all(filtered):
                    pairs.add((first, second))
        return frozenset(pairs)


def _checked(shape: ConvexShape) -> ConvexShape:
    extent = float(np.abs(shape.vertices).max()) + shape.radius
    if not extent <= _LARGEST:
        raise TypeError(f"it reaches {extent:.3g} m from its joint")
    return shape


# Which bodies of the plant make up the components of a tree that was read.


def component_bodies(team: TeamPlant, tree: ComponentTree) -> tuple[list[set[int]], list[FloatArray]]:
    """Return the indices of the bodies of every component, and its origin where all joints are at zero [m].

    Args:
        team: The team.
        tree: Its component tree.
    """
    origins, groups = [np.zeros(2)], [_welded(team, team.object_body)]
    for component in tree.components[1:]:
        assert component.joint is not None
        assert component.parent is not None
        joint = team.joints[component.joint.index]
        sides = [joint.parent_body(), joint.child_body()]
        outer = sides[1] if int(sides[0].index()) in groups[component.parent] else sides[0]
        groups.append(_welded(team, outer))
        origins.append(origins[component.parent] + (component.joint.X_PJ.x, component.joint.X_PJ.y))
    return groups, origins


def _welded(team: TeamPlant, body: RigidBody) -> set[int]:
    return {int(part.index()) for part in team.plant.GetBodiesWeldedTo(body)}


def base_components(team: TeamPlant, groups: list[set[int]]) -> tuple[int, ...]:
    """Return the component of every robot's base, given the bodies of every component."""
    bases = [int(robot.base_body.index()) for robot in team.robots]
    return tuple(next(i for i, group in enumerate(groups) if base in group) for base in bases)


def base_points(team: TeamPlant, tree: ComponentTree) -> tuple[tuple[int, ...], list[FloatArray]]:
    """Return the component of every robot's base, and the origin of Bk in that component's frame [m]."""
    components = base_components(team, component_bodies(team, tree)[0])
    poses = tree.poses(np.zeros(3 + len(tree.joints)))
    context = team.plant.CreateDefaultContext()
    team.plant.SetPositions(context, np.zeros(team.plant.num_positions()))
    places = [robot.base_body.EvalPoseInWorld(context).translation()[:2] for robot in team.robots]
    return components, [
        poses[component].inverse().apply(place[None])[0]
        for component, place in zip(components, places, strict=True)
    ]
