"""What touches along a path, where, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from coop_drake.answers import PlanningProblem
from coop_drake.drawing import BodyFootprint, team_footprints
from coop_drake.geometry.polygons import edges_of
from coop_drake.geometry.swept_tree import Interval
from coop_drake.planning.questions import exact_footprint
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree

# Collisions at one configuration: bodies that leave the floor, bodies that overlap.

NEGLIGIBLE = 1e-4
"""Less deep than this is no collision: arcs are polygons here [m]."""

ROUNDING = 1e-9
"""A corner of a wall this near to a part of a body is inside it [m]."""

Depth = tuple[float, FloatArray, FloatArray]


@dataclass(frozen=True)
class Contact:
    """One body that leaves the floor on one side.

    Attributes:
        body: Its name.
        robot: Its robot, None for the object.
        depth: How far [m].
        point: Its point that is farthest out, shape (2,) [m].
        wall: Point of the wall nearest to that, shape (2,) [m].
    """

    body: str
    robot: int | None
    depth: float
    point: FloatArray
    wall: FloatArray


@dataclass(frozen=True)
class Overlap:
    """Two bodies that overlap.

    Attributes:
        bodies: Their names.
        depth: How far one would have to move to leave the other, convex piece by convex piece [m].
    """

    bodies: tuple[str, str]
    depth: float


def contacts(workspace: Polygon, tree: ComponentTree, configuration: FloatArray) -> list[Contact]:
    """Bodies that leave the floor W at z, shape (3 + n,), one entry for each side, the deepest first."""
    found = []
    shapely.prepare(workspace)
    for footprint in team_footprints(tree, configuration):
        if not workspace.covers(footprint.shape):
            found += _outside(workspace, footprint)
    return sorted(found, key=lambda contact: (-contact.depth, contact.body))


def deepest(workspace: Polygon, tree: ComponentTree, configuration: FloatArray) -> float:
    """How far the bodies leave the floor at most, 0 if none does [m]; arguments as above."""
    found = contacts(workspace, tree, configuration)
    return found[0].depth if found else 0.0


def _outside(workspace: Polygon, footprint: BodyFootprint) -> list[Contact]:
    """One contact for every part of a body outside the floor, measured where it is deepest."""
    found = []
    for part in shapely.get_parts(shapely.difference(footprint.shape, workspace)):
        depth, point, wall = max(
            [_farthest_corner(workspace, part), *_wall_corners(workspace, footprint, part)],
            key=lambda entry: entry[0],
        )
        if depth > NEGLIGIBLE:
            found.append(Contact(footprint.name, footprint.robot, depth, point, wall))
    return found


def _farthest_corner(workspace: Polygon, part: BaseGeometry) -> Depth:
    """The corner of a part that is farthest from the floor, and the point of the wall nearest to it."""
    corners = shapely.get_coordinates(part)
    depths = [workspace.distance(Point(corner)) for corner in corners]
    worst = depths.index(max(depths))
    ends = shapely.get_coordinates(shapely.shortest_line(Point(corners[worst]), workspace.boundary))
    return depths[worst], ends[0], ends[-1]


def _wall_corners(workspace: Polygon, footprint: BodyFootprint, part: BaseGeometry) -> list[Depth]:
    """Corners of the walls inside a body: how far each is from the body's outline, and where."""
    near = part.buffer(ROUNDING)
    entries = []
    for corner in shapely.get_coordinates(workspace):
        place = Point(corner)
        if near.contains(place) and footprint.shape.contains(place):
            ends = shapely.get_coordinates(shapely.shortest_line(place, part.boundary.difference(workspace)))
            if len(ends):
                entries.append((float(np.hypot(*(ends[-1] - corner))), ends[-1], corner))
    return entries


def overlaps(tree: ComponentTree, configuration: FloatArray) -> list[Overlap]:
    """Pairs of bodies that overlap at z, shape (3 + n,), but must not, the deepest first."""
    poses = tree.poses(configuration)
    found = []
    for (i, j), (k, m) in tree.collision_pairs:
        first, second = tree.components[i].bodies[j], tree.components[k].bodies[m]
        depth = max(
            (
                _depth(poses[i].apply(a.vertices), a.radius, poses[k].apply(b.vertices), b.radius)
                for a, b in product(first.shapes, second.shapes)
            ),
            default=0.0,
        )
        if depth > NEGLIGIBLE:
            found.append(Overlap((first.name, second.name), depth))
    return sorted(found, key=lambda overlap: (-overlap.depth, overlap.bodies))


def _depth(a: FloatArray, grown_a: float, b: FloatArray, grown_b: float) -> float:
    """Depth of the overlap of two grown convex polygons: the origin's depth in their Minkowski difference."""
    hull = shapely.MultiPoint((a[:, None, :] - b[None, :, :]).reshape(-1, 2)).convex_hull
    origin, grown = Point(0.0, 0.0), grown_a + grown_b
    if isinstance(hull, Polygon) and hull.covers(origin):
        return grown + float(hull.exterior.distance(origin))
    return max(0.0, grown - float(hull.distance(origin)))


# The gap between two walls that face each other.

FACING = 0.3
"""Cosine of the largest angle between a wall's normal and the direction to the wall that it faces [-]."""

AWAY = 1e-6
"""Points nearer than this are the same [m]."""


@dataclass(frozen=True)
class Gap:
    """Two points of the walls that face each other across the floor.

    Attributes:
        first: One of them, shape (2,) [m].
        second: The other, shape (2,) [m].
    """

    first: FloatArray
    second: FloatArray

    @property
    def width(self) -> float:
        """Their distance [m]."""
        return float(np.hypot(*(self.second - self.first)))


def narrowest_gap(workspace: Polygon, walls: Sequence[FloatArray]) -> Gap | None:
    """The narrowest gap between some points of the walls, (2,) each [m], and the walls across the floor.

    None where no wall faces any of the points.
    """
    edges = edges_of(orient(workspace))  # The floor lies to the left of every edge.
    floor = workspace.buffer(AWAY, join_style="mitre")
    gaps = [_gap(edges, floor, wall) for wall in walls]
    return min((gap for gap in gaps if gap is not None), key=lambda gap: gap.width, default=None)


def _gap(edges: FloatArray, floor: Polygon, wall: FloatArray) -> Gap | None:
    """The narrowest gap at one point of the walls."""
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    length = np.maximum(np.hypot(*along.T), 1e-12)
    inward = np.column_stack((-along[:, 1], along[:, 0])) / length[:, None]
    fraction = np.clip(((wall - start) * along).sum(axis=1) / length**2, 0.0, 1.0)
    across = start + fraction[:, None] * along
    away = across - wall
    width = np.hypot(*away.T)
    direction = away / np.maximum(width, 1e-12)[:, None]
    own = inward[width <= AWAY]  # Normals of the edges that the point itself lies on: two at a corner.
    faced = (direction @ own.T).max(axis=1, initial=-1.0) >= FACING
    facing = (inward * direction).sum(axis=1) <= -FACING
    for index in np.argsort(width, kind="stable"):
        if faced[index] and facing[index] and width[index] > AWAY:
            line = LineString([wall, across[index]])
            if floor.covers(line):
                return Gap(wall, across[index])
    return None


# Stretches of a path on which the team collides with walls: which bodies, how deep, at which angles.

NOTICED = 0.05
"""Collisions less deep than this fraction of the deepest one on the path are left out [-]."""

APART = 0.3
"""Collisions further apart along the path than this belong to two stretches [m]."""

LEAD, BORDER = 0.15, 0.15
"""Length of path before and after a stretch, and border around the team, that its zone includes [m]."""

AT_LIMIT = 0.02
"""A joint is at its limit if it is nearer to it than this fraction of its range [-]."""


@dataclass(frozen=True)
class BodyAtFault:
    """A body that collides with a wall on a stretch.

    Attributes:
        name: Its name.
        robot: Its robot, None for the object.
        depth: How far it leaves the floor at most [m].
        axes: Names of the axes that move it: ``theta`` and the joints between it and the object.
        intervals: Interval of each of these over the configurations in collision [rad or m].
    """

    name: str
    robot: int | None
    depth: float
    axes: tuple[str, ...]
    intervals: tuple[Interval, ...]


@dataclass(frozen=True)
class CollidingStretch:
    """One stretch of a path on which the team collides with walls.

    Attributes:
        configuration: Where it leaves the floor most, on two sides together, shape (3 + n,) [m, rad].
        contacts: The collisions there, the deepest first.
        gap: The walls on both sides there, None if only one wall is in the way.
        bodies: All bodies that collide on the stretch, the deepest first.
        limits: Names of the joints that reach a limit on the stretch.
        zone: What the team covers on the stretch, with a border, in W [m].
    """

    configuration: FloatArray
    contacts: tuple[Contact, ...]
    gap: Gap | None
    bodies: tuple[BodyAtFault, ...]
    limits: tuple[str, ...]
    zone: BaseGeometry


def colliding_stretches(problem: PlanningProblem, path: FloatArray) -> list[CollidingStretch]:
    """The stretches of a path on which the team collides with walls, in the path's order.

    The path has configurations from start to goal, shape (m, 3 + n) [m, rad], the problem the floor as it is.
    """
    found = [contacts(problem.workspace, problem.tree, z) for z in path]
    deepest = np.array([max((contact.depth for contact in here), default=0.0) for here in found])
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))))
    least = NOTICED * float(deepest.max())
    found = [[contact for contact in here if contact.depth > least] for here in found]
    rows = np.flatnonzero(deepest > least)
    cuts = np.flatnonzero((np.diff(along[rows]) > APART) & (np.diff(rows) > 1)) + 1
    runs = np.split(rows, cuts) if len(rows) else []
    return [_stretch(problem, path, found, run.tolist(), along) for run in runs]


def _stretch(
    problem: PlanningProblem,
    path: FloatArray,
    found: Sequence[Sequence[Contact]],
    rows: Sequence[int],
    along: FloatArray,
) -> CollidingStretch:
    tightest = max(rows, key=lambda row: _depth_on_both_sides(found[row]))
    touched = [contact.wall for contact in found[tightest]]
    near = (along >= along[rows[0]] - LEAD) & (along <= along[rows[-1]] + LEAD)
    covered = shapely.union_all([exact_footprint(problem.tree, z) for z in path[near]])
    return CollidingStretch(
        configuration=path[tightest],
        contacts=tuple(found[tightest]),
        gap=narrowest_gap(problem.workspace, touched),
        bodies=_bodies(problem, path, found, rows),
        limits=_limits(problem, path[rows]),
        zone=covered.buffer(BORDER, quad_segs=4),
    )


def _depth_on_both_sides(found: Sequence[Contact]) -> float:
    """Depth of two contacts on opposite sides together: in a gap it is the same at all positions."""
    best = found[0].depth
    for number, first in enumerate(found):
        out = (first.point - first.wall) / first.depth
        for second in found[number + 1 :]:
            if float(out @ (second.point - second.wall)) < 0.0:
                best = max(best, first.depth + second.depth)
    return best


def _bodies(
    problem: PlanningProblem, path: FloatArray, found: Sequence[Sequence[Contact]], rows: Sequence[int]
) -> tuple[BodyAtFault, ...]:
    places: dict[str, list[int]] = {}
    worst: dict[str, Contact] = {}
    for row in rows:
        for contact in found[row]:
            places.setdefault(contact.body, []).append(row)
            if contact.body not in worst or contact.depth > worst[contact.body].depth:
                worst[contact.body] = contact
    bodies = []
    for name, contact in worst.items():
        columns, axes = _axes(problem, name)
        values = path[places[name]][:, columns]
        intervals = tuple(
            (float(low), float(high))
            for low, high in zip(values.min(axis=0), values.max(axis=0), strict=True)
        )
        bodies.append(BodyAtFault(name, contact.robot, contact.depth, axes, intervals))
    return tuple(sorted(bodies, key=lambda body: (-body.depth, body.name)))


def _axes(problem: PlanningProblem, name: str) -> tuple[list[int], tuple[str, ...]]:
    """Columns of z that change a body's angle in W, and their names."""
    tree = problem.tree
    (index,) = [i for i, c in enumerate(tree.components) if any(body.name == name for body in c.bodies)]
    joints = [tree.components[i].joint for i in tree.ancestors[index]]
    moving = sorted((joint for joint in joints if joint is not None), key=lambda joint: joint.index)
    return [2, *(3 + joint.index for joint in moving)], ("theta", *(joint.name for joint in moving))


def _limits(problem: PlanningProblem, path: FloatArray) -> tuple[str, ...]:
    """Names of joints that come near a limit."""
    near = []
    for joint in problem.tree.joints:
        if joint.circular:
            continue
        values, near_limit = path[:, 3 + joint.index], AT_LIMIT * (joint.upper - joint.lower)
        if values.min() <= joint.lower + near_limit or values.max() >= joint.upper - near_limit:
            near.append(joint.name)
    return tuple(near)
