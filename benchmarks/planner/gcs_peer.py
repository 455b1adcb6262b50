"""Drake's own planner: convex regions of the configuration space (IRIS), then a graph of them (GCS).

The regions are grown around configurations of a path that the compiled RRT-Connect found before, wherever no
region made so far holds the path: as few seeds as this planner can do with, and given to it for nothing. The
search for regions and the graph's solution are timed. ``IrisNp2`` makes the regions, with its default options
and one thread: on `base` ``IrisZo`` took 2.5 times as long with its default options, and with five times the
share of a region that may collide (``epsilon``) about as long, for a path that collided.

The plant has the bodies' footprints as prisms on a floor whose walls are cut into triangles; discs are
cylinders, other rounded shapes get 24 corners for a whole turn.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from time import process_time

import numpy as np
import shapely
from pydrake.common import Parallelism
from pydrake.geometry import Convex, Cylinder
from pydrake.geometry.optimization import GraphOfConvexSetsOptions, HPolyhedron, Hyperellipsoid, Point
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, RevoluteJoint, SpatialInertia
from pydrake.planning import (
    GcsTrajectoryOptimization,
    IrisNp2,
    IrisNp2Options,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
)
from shapely.geometry.base import BaseGeometry

from benchmarks.questions.peers import run_trees
from coop_drake.answers import PlanningProblem
from coop_drake.tree import PlanarPose
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ConvexShape, TreeJoint, configuration_scale

_SEEDS = range(1, 12)
"""Seeds of the trees, of which the first path is taken."""
_STEP = 0.02
"""Distance between configurations of the path that must lie in regions [m]."""
_HEIGHT = 1.0
"""Height of all bodies; walls are twice as high [m]."""
_BESIDE = 1.0
"""Thickness of the walls about the floor [m], and room beyond the path's angles [rad]."""
_SAMPLES = 400
"""Configurations of the trajectory that are handed on."""


@dataclass(frozen=True)
class GcsRun:
    """What came of the regions and their graph.

    Attributes:
        regions: How many regions were made.
        region_seconds: CPU time for them [s].
        solve_seconds: CPU time for the graph [s].
        path: Configurations of the trajectory from start to goal, shape (m, 3 + n); no rows if there is none.
    """

    regions: int
    region_seconds: float
    solve_seconds: float
    path: FloatArray


def run_gcs(problem: PlanningProblem, budget: float) -> GcsRun:
    """Make regions along a known path and find the shortest way through them.

    Args:
        problem: The question; the compiled trees must find a path.
        budget: CPU time after which no further region is begun [s].
    """
    logging.getLogger("drake").setLevel(logging.ERROR)
    known = next(run.path for run in run_trees(problem, _SEEDS) if run.found)
    checker, places = _checker(problem)
    path = np.array([*_densified(known, configuration_scale(problem.tree))])
    dense = np.empty_like(path)
    dense[:, places] = path
    begin = process_time()
    regions = _regions(checker, dense, _domain(problem, path, places), budget)
    made = process_time()
    trajectory = _shortest(regions, dense[0], dense[-1])
    return GcsRun(len(regions), made - begin, process_time() - made, trajectory[:, places])


def _regions(
    checker: SceneGraphCollisionChecker, path: FloatArray, domain: HPolyhedron, budget: float
) -> list[HPolyhedron]:
    """Grow a region about every configuration of the path that no region holds yet."""
    options, begin = IrisNp2Options(), process_time()
    regions: list[HPolyhedron] = []
    options.sampled_iris_options.parallelism = Parallelism(num_threads=1)
    for configuration in path:
        if any(region.PointInSet(configuration, 1e-9) for region in regions):
            continue
        if process_time() - begin > budget:
            break
        seed = Hyperellipsoid.MakeHypersphere(1e-2, configuration)
        with suppress(RuntimeError):  # It refuses seeds that are nearer to a wall or limit than its margin.
            regions.append(IrisNp2(checker, seed, domain, options))
    return regions


def _shortest(regions: list[HPolyhedron], start: FloatArray, goal: FloatArray) -> FloatArray:
    """Return configurations of the shortest trajectory through the regions, none if there is no way."""
    if not regions:
        return np.empty((0, len(start)))
    graph = GcsTrajectoryOptimization(len(start))
    inner = graph.AddRegions(regions, order=1)
    first, last = (graph.AddRegions([Point(end)], order=0) for end in (start, goal))
    graph.AddEdges(first, inner)
    graph.AddEdges(inner, last)
    graph.AddPathLengthCost(1.0)
    options = GraphOfConvexSetsOptions()
    options.convex_relaxation, options.max_rounded_paths = True, 5
    trajectory, result = graph.SolvePath(first, last, options)
    if not result.is_success():
        return np.empty((0, len(start)))
    times = np.linspace(trajectory.start_time(), trajectory.end_time(), _SAMPLES)
    return np.array([trajectory.value(time)[:, 0] for time in times])


def _densified(path: FloatArray, scale: FloatArray) -> Iterator[FloatArray]:
    yield path[0]
    for begin, end in pairwise(path):
        steps = max(1, int(np.ceil(np.abs((end - begin) * scale).max() / _STEP)))
        yield from (begin + (end - begin) * k / steps for k in range(1, steps + 1))


def _domain(problem: PlanningProblem, path: FloatArray, places: list[int]) -> HPolyhedron:
    """The box of all configurations; angles of the object go a bit further than on the path."""
    x_lower, y_lower, x_upper, y_upper = problem.workspace.bounds
    tree, angles = problem.tree, path[:, 2]
    lower, upper = np.empty(len(places)), np.empty(len(places))
    lower[places] = [x_lower, y_lower, angles.min() - _BESIDE, *tree.joint_lower]
    upper[places] = [x_upper, y_upper, angles.max() + _BESIDE, *tree.joint_upper]
    return HPolyhedron.MakeBox(lower, upper)


def _checker(problem: PlanningProblem) -> tuple[SceneGraphCollisionChecker, list[int]]:
    """Build a plant; return its checker, and where (x, y, theta, q...) stand in its positions."""
    builder, tree = RobotDiagramBuilder(time_step=0.0), problem.tree
    plant = builder.plant()
    team, inertia = plant.AddModelInstance("team"), SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    slides = [plant.AddRigidBody(f"slide_{axis}", team, inertia) for axis in "xy"]
    frames, bodies = [], {}
    for index, component in enumerate(tree.components):
        carrier = plant.AddRigidBody(f"component_{index}", team, inertia)
        frames.append(carrier.body_frame())
        for body in component.bodies:
            bodies[body.name] = plant.AddRigidBody(body.name.replace("::", "_"), team, inertia)
            plant.WeldFrames(carrier.body_frame(), bodies[body.name].body_frame())
            for number, shape in enumerate(body.shapes):
                _add_footprint(plant, bodies[body.name], shape, number)
    world, between, last = plant.world_frame(), *(slide.body_frame() for slide in slides)
    joints = [
        plant.AddJoint(PrismaticJoint("x", world, between, [1.0, 0.0, 0.0])),
        plant.AddJoint(PrismaticJoint("y", between, last, [0.0, 1.0, 0.0])),
        plant.AddJoint(RevoluteJoint("theta", last, frames[0], [0.0, 0.0, 1.0])),
    ]
    joined = {
        component.joint.index: _add_joint(plant, component.joint, frames[component.parent], frames[index])
        for index, component in enumerate(tree.components)
        if component.joint is not None and component.parent is not None
    }
    joints += [joined[index] for index in range(len(tree.joints))]
    _add_walls(plant, problem.workspace)
    plant.Finalize()
    checker = SceneGraphCollisionChecker(
        model=builder.Build(), robot_model_instances=[team], edge_step_size=_STEP
    )
    for first, second in tree.unchecked_pairs:
        if first in bodies and second in bodies:
            checker.SetCollisionFilteredBetween(bodies[first].index(), bodies[second].index(), True)
    return checker, [joint.position_start() for joint in joints]


def _add_footprint(plant: MultibodyPlant, body: object, shape: ConvexShape, number: int) -> None:
    corners, pose = shapely.MultiPoint(shape.vertices).convex_hull, RigidTransform()
    if len(shape.vertices) == 1:
        solid, pose = Cylinder(shape.radius, _HEIGHT), RigidTransform([*shape.vertices[0], 0.0])
    else:
        solid = _prism(corners.buffer(shape.radius, quad_segs=6) if shape.radius else corners, _HEIGHT)
    plant.RegisterCollisionGeometry(body, pose, solid, f"footprint_{number}", CoulombFriction())


def _add_walls(plant: MultibodyPlant, floor: shapely.Polygon) -> None:
    x_lower, y_lower, x_upper, y_upper = floor.bounds
    outside = shapely.box(x_lower - _BESIDE, y_lower - _BESIDE, x_upper + _BESIDE, y_upper + _BESIDE)
    triangles = shapely.constrained_delaunay_triangles(outside.difference(floor)).geoms
    for number, triangle in enumerate(triangles):
        wall = _prism(triangle, 2.0 * _HEIGHT), f"wall_{number}", CoulombFriction()
        plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), *wall)


def _prism(polygon: BaseGeometry, height: float) -> Convex:
    corners = shapely.get_coordinates(polygon)[:-1]
    ends = [np.column_stack([corners, np.full(len(corners), sign * 0.5 * height)]) for sign in (-1.0, 1.0)]
    return Convex(np.vstack(ends).T, "prism")


def _add_joint(plant: MultibodyPlant, joint: TreeJoint, parent: object, child: object) -> object:
    name = joint.name.replace("::", "_")
    frame = plant.AddFrame(FixedOffsetFrame(f"{name}_frame", parent, _transform(joint.X_PJ)))
    if joint.kind == "revolute":
        return plant.AddJoint(RevoluteJoint(name, frame, child, [0.0, 0.0, joint.sign]))
    return plant.AddJoint(PrismaticJoint(name, frame, child, [*joint.axis, 0.0]))


def _transform(pose: PlanarPose) -> RigidTransform:
    return RigidTransform(RotationMatrix.MakeZRotation(pose.angle), [pose.x, pose.y, 0.0])
