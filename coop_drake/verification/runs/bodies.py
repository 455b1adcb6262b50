"""Bodies in a run: kinematics of the verifier's own, mechanics, and that nothing met a wall or another body.

A stage is one joint that moves a solid; the stages of a component begin with its own joint and end with theta
of the object. Configurations z = (x, y, theta, q...) of a log have shape (T, 3 + n) [m, rad]: the value of a
joint stands at 3 + its index.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem
from coop_drake.progress import Progress
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree, PlanarPose, TreeJoint
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.rows import Between, BodyMass, Rows, RunSetup

THETA = TreeJoint("theta", "revolute", -1, -1, PlanarPose(), 1.0, (0.0, 0.0), -inf, inf)
"""The object's angle as the joint by which the floor carries the object: it stands before q in z."""

Stages = tuple[TreeJoint, ...]
"""What moves a component: its own joint first, theta last."""


@dataclass(frozen=True)
class Solid:
    """One convex piece of one body.

    Attributes:
        name: Name of its body.
        component: Index of its component.
        body: Index of its body in the component.
        vertices: Vertices in the component's frame, counter-clockwise, shape (n, 2) [m].
        radius: The solid is the hull of its vertices, grown by this [m].
        stages: What moves it: its own joint first, theta last.
    """

    name: str
    component: int
    body: int
    vertices: FloatArray
    radius: float
    stages: Stages


def team_solids(tree: ComponentTree) -> tuple[Solid, ...]:
    """List every convex piece of a team."""
    return tuple(
        Solid(body.name, index, number, np.asarray(shape.vertices, dtype=float), shape.radius, stages)
        for index, component in enumerate(tree.components)
        for stages in [component_stages(tree, index)]
        for number, body in enumerate(component.bodies)
        for shape in body.shapes
    )


def component_stages(tree: ComponentTree, index: int) -> Stages:
    """The stages that move a component: its own joint first, theta last."""
    joints = (tree.components[i].joint for i in tree.ancestors[index])
    return (*[joint for joint in joints if joint is not None], THETA)


def checked_pairs(
    tree: ComponentTree, solids: Collection[Solid]
) -> tuple[tuple[Solid, Solid, int, int], ...]:
    """Pairs of solids that must never overlap.

    With each pair stand, for both solids, the number of joints up to the component that carries the two.
    """
    members: dict[tuple[int, int], list[Solid]] = {}
    for solid in solids:
        members.setdefault((solid.component, solid.body), []).append(solid)
    pairs = []
    for first, second in tree.collision_pairs:
        one, other = (tree.ancestors[component] for component, _ in (first, second))
        common = max(set(one) & set(other))
        pairs += [
            (a, b, one.index(common), other.index(common))
            for a in members.get(first, [])
            for b in members.get(second, [])
        ]
    return tuple(pairs)


def cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """The component out of the plane of the product of vectors (T, 2), shape (T,)."""
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def left(vectors: FloatArray) -> FloatArray:
    """Vectors (T, 2) turned by a right angle, counter-clockwise."""
    return np.column_stack((-vectors[:, 1], vectors[:, 0]))


def turned(vectors: FloatArray, angles: FloatArray) -> FloatArray:
    """Vectors (T, 2) turned by angles (T,)."""
    c, s = np.cos(angles), np.sin(angles)
    return np.column_stack((c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]))


def points_in_world(points: FloatArray, stages: Stages, z: FloatArray) -> FloatArray:
    """Carry points of one component to W by its stages.

    Args:
        points: Points in the component's frame, shape (m, 2) [m].
        stages: What moves the component: its own joint first, theta last.
        z: Configurations (x, y, theta, q...), shape (T, 3 + n) [m, rad].

    Returns:
        Shape (T, m, 2) [m].
    """
    carried = np.broadcast_to(points, (len(z), *points.shape))
    for stage in stages:
        values = z[:, 3 + stage.index]
        if stage.kind == "prismatic":
            carried = carried + values[:, None, None] * np.array(stage.axis)
        else:
            c, s = np.cos(stage.sign * values)[:, None], np.sin(stage.sign * values)[:, None]
            x, y = carried[..., 0], carried[..., 1]
            carried = np.stack((c * x - s * y, s * x + c * y), axis=-1)
        carried = stage.X_PJ.apply(carried)
    placed: FloatArray = carried + z[:, None, :2]
    return placed


def turns(stages: Stages, z: FloatArray) -> FloatArray:
    """Angles of one component in W, not wrapped, shape (T,) [rad]; arguments as above."""
    angles = np.zeros(len(z))
    for stage in stages:
        angles += stage.X_PJ.angle
        if stage.kind == "revolute":
            angles += stage.sign * z[:, 3 + stage.index]
    return angles


def levers(reach: float, stages: Stages, most: FloatArray) -> FloatArray:
    """Bound how far a point of a component moves for each unit of every stage, at all configurations.

    Args:
        reach: Largest distance of the component's points from its frame's origin [m].
        stages: The stages that count: its own joint first.
        most: Largest magnitudes of z, which bound how far joints slide, shape (3 + n,) [m, rad].

    Returns:
        One bound for each stage, shape (stages,) [m for each rad, or m for each m].
    """
    bounds = []
    for stage in stages:
        if stage.kind == "prismatic":
            slide = float(np.hypot(*stage.axis))
            bounds.append(slide)
            reach += slide * float(most[3 + stage.index])
        else:
            bounds.append(reach)
        reach += float(np.hypot(stage.X_PJ.x, stage.X_PJ.y))
    return np.array(bounds)


class Motion(NamedTuple):
    """How a point of a component moves in W.

    Attributes:
        place: Its position from the object's origin, shape (T, 2) [m].
        velocity: Shape (T, 2) [m/s].
        acceleration: Shape (T, 2) [m/s^2].
        rate: Rate of the component's angle, shape (T,) [rad/s].
        turning: Its second derivative, shape (T,) [rad/s^2].
    """

    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    rate: FloatArray
    turning: FloatArray


def moved(
    point: FloatArray, stages: Stages, z: FloatArray, rates: FloatArray, accelerations: FloatArray
) -> Motion:
    """Carry a point of a component, shape (2,) [m], with its derivatives through its stages."""
    count = len(z)
    x, v, a = np.tile(point, (count, 1)), np.zeros((count, 2)), np.zeros((count, 2))
    spin, turning = np.zeros(count), np.zeros(count)
    for stage in stages:
        scale = stage.sign if stage.kind == "revolute" else 1.0
        q, rate, second = (scale * values[:, 3 + stage.index] for values in (z, rates, accelerations))
        if stage.kind == "prismatic":
            x, v, a = (old + new[:, None] * stage.axis for old, new in ((x, q), (v, rate), (a, second)))
        else:
            x, v, a = (turned(old, q) for old in (x, v, a))
            w = rate[:, None]
            a = a + 2.0 * w * left(v) + second[:, None] * left(x) - w * w * x
            v, spin, turning = v + w * left(x), spin + rate, turning + second
        angle = np.full(count, stage.X_PJ.angle)
        x, v, a = (turned(old, angle) for old in (x, v, a))
        x = x + np.array([stage.X_PJ.x, stage.X_PJ.y])
    return Motion(x, v + rates[:, :2], a + accelerations[:, :2], spin, turning)


# Efforts, wrenches at the grasps and speeds of a run, by kinematics and mechanics.

SAME = 1e-9
"""Forces that are computed twice may differ by this share of the sizes of their terms [-]."""

RIGID = 1e-8
"""Rigid grasps leave a base where the joints put it, up to this [m, rad]."""

LOOSE = 1e-4
"""Largest error of a grasp that is a constraint [m], with which runs end, too; it yields by some 1e-8 m for
each newton."""

EXACT_WRENCH = 1e-8
"""Largest difference between measured and commanded wrenches of an ideal team [N, N m]."""

EXACT_ACCELERATION = 1e-9
"""Largest difference between realised and commanded accelerations of an ideal team [m/s^2, rad/s^2]."""


def check_grasps(rows: Rows, problem: PlanningProblem, setup: RunSetup) -> Check:
    """Check that bases stand where object and joints put them, so that end effectors are at their grasps.

    Each base is fixed on one component that the robot's joints carry. Its pose there is the same in all rows.
    """
    log, tree = rows.log, problem.tree
    rows.require_same("grasp_error", np.zeros(len(log.times)), RIGID if setup.rigid else LOOSE)
    allowed = RIGID if setup.rigid else LOOSE + 2.0 * tree.reach * LOOSE
    largest = 0.0
    for k in range(len(setup.robot_names)):
        own = [i for i, c in enumerate(tree.components) if c.joint is not None and c.joint.robot == k]
        away = np.min([_offset(rows, component_stages(tree, i), k) for i in (0, *own)], axis=0)
        text = f"base of robot {k} is {{:.3g}} m or rad from where object and joints put it"
        rows.require(away <= allowed, "base_poses, object_pose, joints", text, away)
        largest = max(largest, float(away.max()))
    name = "bases stand where the grasps and the joints put them"
    arrays = ("base_poses", "grasp_error") if setup.rigid else ("base_poses",)
    return Check(name, len(log.times), largest, "m or rad, largest", arrays)


def check_wrenches(rows: Rows, setup: RunSetup) -> Check:
    """Check that the stated sums and differences of the wrenches at the grasps are right."""
    log = rows.log
    commanded, bodies = log.commanded_wrenches, [body for body in setup.bodies if body.robot is None]
    error = np.abs(log.measured_wrenches - commanded).max(axis=(1, 2))
    size = 1.0 + np.abs(commanded).sum(axis=(1, 2))
    rows.require_same("wrench_error", error, SAME * size)
    mass = np.array([body.mass for body in bodies])
    centre = mass @ np.array([body.p_CBcm for body in bodies]) / mass.sum()
    total = about_object(rows, setup, commanded, centre).sum(axis=1)
    rows.require_same("object_wrench", total, SAME * size[:, None])
    largest = (EXACT_WRENCH, EXACT_ACCELERATION) if setup.exact else (np.inf, np.inf)
    for name, limit in zip(("wrench_error", "acceleration_error"), largest, strict=True):
        stated = getattr(log, name)
        rows.require((stated >= 0.0) & (stated <= limit), name, f"is {{:.3g}}; expected 0 to {limit}", stated)
    ideal = ("commanded_wrenches", "acceleration_error") if setup.exact else ()
    arrays = ("object_wrench", "wrench_error", *ideal)
    name = "wrenches add up to the object's"
    return Check(name, commanded.size, float(error.max()), "N or N m, largest error", arrays)


def about_object(rows: Rows, setup: RunSetup, wrenches: FloatArray, centre: FloatArray) -> FloatArray:
    """Wrenches at the grasps, (T, N, 3), about a point fixed on the object, given in L [m]."""
    angle, moved = rows.z[:, 2], wrenches.copy()
    for k, grasp in enumerate(setup.grasps):
        lever = turned(np.tile(grasp - centre, (len(angle), 1)), angle)
        moved[:, k, 2] += cross(lever, wrenches[:, k, :2])
    return moved


def _offset(rows: Rows, stages: Stages, robot: int) -> FloatArray:
    """By how much a base's pose on a component differs from the typical one, shape (T,) [m, rad]."""
    angle = turns(stages, rows.z)
    origin = points_in_world(np.zeros((1, 2)), stages, rows.z)[:, 0]
    pose = rows.log.base_poses[:, robot]
    place, turn = turned(pose[:, :2] - origin, -angle), pose[:, 2] - angle
    turn = turn - np.median(turn)
    turn -= 2.0 * np.pi * np.rint(turn / (2.0 * np.pi))
    turn -= np.median(turn)
    away: FloatArray = np.abs(np.column_stack((place - np.median(place, axis=0), turn))).max(axis=1)
    return away


# Check a run's efforts by mechanics: Newton's and Euler's equations of the object and of every robot.
#
# About the object's origin, the sum of m a and of I w' + r x m a over all bodies of a robot is the wrench
# of its base less that at its grasp. Of the bodies that a joint carries outwards, the same sum less the
# base's wrench, taken along the joint, is the joint's effort but for its damping, its rotor's inertia, and
# a dry friction up to the scenario's.


Needs = Sequence[tuple[BodyMass, tuple[FloatArray, FloatArray]]]
"""Bodies, each with what its motion needs: forces (T, 3) about the object's origin, and their size (T,)."""


def check_mechanics(rows: Rows, problem: PlanningProblem, setup: RunSetup) -> Check:
    """Check base wrenches, joint efforts and wrenches at the grasps against the motion."""
    log, tree, count = rows.log, problem.tree, len(rows.z)
    needs = [(body, _inertial_force(rows, tree, body)) for body in setup.bodies]
    at_grasps = about_object(rows, setup, log.measured_wrenches, np.zeros(2))
    _require(rows, "measured_wrenches, accelerations", at_grasps.sum(axis=1), _sum(needs, count, robot=None))
    for k in range(len(setup.robot_names)):
        found = _base(rows, k) - at_grasps[:, k]
        _require(rows, "base_wrenches, measured_wrenches", found, _sum(needs, count, robot=k))
    for joint in tree.joints:
        _check_joint(rows, tree, setup, joint, needs)
    efforts = log.base_wrenches.size + log.joint_torques.size
    arrays = "accelerations", "measured_wrenches", "base_wrenches", "joint_torques"
    return Check("efforts, wrenches at the grasps and accelerations obey mechanics", efforts, arrays=arrays)


def _check_joint(rows: Rows, tree: ComponentTree, setup: RunSetup, joint: TreeJoint, needs: Needs) -> None:
    """Check one joint's effort: what its outer side needs along it."""
    index = next(i for i, component in enumerate(tree.components) if component.joint is joint)
    outer = [i for i, ancestors in enumerate(tree.ancestors) if index in ancestors]
    log, j, stages = rows.log, joint.index, component_stages(tree, index)
    force, size = _sum([need for need in needs if need[0].component in outer], len(rows.z))
    base = _base(rows, joint.robot)
    force, size = force - base, size + np.abs(base).sum(axis=1)
    if joint.kind == "revolute":
        pivot = points_in_world(np.zeros((1, 2)), stages, rows.z)[:, 0] - rows.z[:, :2]
        along = joint.sign * (force[:, 2] - cross(pivot, force[:, :2]))
    else:  # a joint that slides does not turn its child against its parent
        axis = turned(np.tile(joint.axis, (len(rows.z), 1)), turns(stages, rows.z))
        along = np.einsum("ij,ij->i", axis, force[:, :2])
    rate, acceleration = log.joint_rates[:, j], log.accelerations[:, 3 + j]
    coulomb, viscous = setup.joint_friction
    own = (setup.joint_damping[j] + viscous) * rate + setup.joint_inertia[j] * acceleration
    needed = np.zeros(log.joint_torques.shape)
    needed[:, j] = along + own
    found = np.where(np.arange(len(tree.joints)) == j, log.joint_torques, 0.0)
    _require(rows, "joint_torques", found, (needed, size + np.abs(own)), coulomb)


def _require(
    rows: Rows, name: str, found: FloatArray, needed: tuple[FloatArray, FloatArray], friction: float = 0.0
) -> None:
    """Refuse forces (T, m) that are not those needed, whose terms have sizes (T,), up to a friction."""
    forces, size = needed
    text = "give {:.9g} N or N m; the motion needs {:.9g}"
    allowed = friction + SAME * (1.0 + size[:, None] + np.abs(found).sum(axis=1, keepdims=True))
    rows.require(np.abs(found - forces) <= allowed, name, text, found, forces)


def _sum(needs: Needs, count: int, robot: int | str | None = "all") -> tuple[FloatArray, FloatArray]:
    """Sum of forces (T, 3) of the bodies of one robot, of the object (None) or of all, and of their sizes."""
    force, size = np.zeros((count, 3)), np.zeros(count)
    for body, (own, terms) in needs:
        if robot in ("all", body.robot):
            force, size = force + own, size + terms
    return force, size


def _inertial_force(rows: Rows, tree: ComponentTree, body: BodyMass) -> tuple[FloatArray, FloatArray]:
    """M a and I w' + r x m a of a body about the object's origin, shape (T, 3), and the terms' size, (T,)."""
    one = moved(
        body.p_CBcm, component_stages(tree, body.component), rows.z, rows.rates, rows.log.accelerations
    )
    force = body.mass * one.acceleration
    moment = body.inertia * one.turning + cross(one.place, force)
    return np.column_stack((force, moment)), np.abs(force).sum(axis=1) + np.abs(moment)


def _base(rows: Rows, robot: int) -> FloatArray:
    """A base's wrench in W about the object's origin, shape (T, 3) [N, N m]."""
    wrench, place = rows.log.base_wrenches[:, robot], rows.log.base_poses[:, robot, :2]
    moment = wrench[:, 2] + cross(place - rows.z[:, :2], wrench[:, :2])
    return np.column_stack((wrench[:, :2], moment))


def check_run_speeds(rows: Rows, problem: PlanningProblem) -> Check | None:
    """Check every measured speed against its limit, stated or usual; None where there is none."""
    limits = problem.limits if rows.plan.motion is None else problem.limits.with_defaults()
    if not limits.any:
        return None
    speeds, rates = np.empty(rows.log.base_poses.shape[:2]), np.empty(rows.log.base_poses.shape[:2])
    for k, (component, point) in enumerate(zip(limits.base_components, limits.base_points, strict=True)):
        stages = component_stages(problem.tree, component)
        one = moved(np.array(point), stages, rows.z, rows.rates, rows.log.accelerations)
        speeds[:, k], rates[:, k] = np.hypot(*one.velocity.T), one.rate
    least, count = 1.0, 0
    for name, found, most in (
        ("base_poses", speeds, limits.base_speeds),
        ("base_poses", np.abs(rates), limits.turn_rates),
        ("joint_rates", np.abs(rows.log.joint_rates), limits.joint_rates),
    ):
        allowed = np.broadcast_to(most, found.shape)
        text = "moves at {:.6g} m/s, rad/s; the limit is {:.6g}"
        rows.require(found <= allowed, name, text, found, allowed)
        count += int(np.isfinite(allowed).sum())
        least = min(least, float((1.0 - found / allowed).min(initial=1.0)))
    return Check("bases and joints kept their limits of speed", count, least, "of one left")


def check_run_efforts(rows: Rows, problem: PlanningProblem) -> list[Check]:
    """Check the acceleration and the effort of every joint in every row against its limit, if it has one.

    Raises:
        RefusalError: Names array, index and time.
    """
    limits, log, checks = problem.limits, rows.log, []
    accelerations = np.concatenate((np.full(3, np.inf), limits.joint_accelerations))
    for what, array, found, most in (
        ("acceleration", "accelerations", log.accelerations, accelerations),
        ("effort", "joint_torques", log.joint_torques, limits.joint_efforts),
    ):
        shares, known = np.abs(found) / most, int(np.isfinite(most).sum())
        if known > 0:
            text = f"is {{:.6g}} times the limit of the joint's {what}"
            rows.require(shares <= 1.0, array, text, shares)
            name, least = f"joints kept their limits of {what}", float(1.0 - shares.max())
            checks.append(Check(name, known * len(shares), least, "of one left"))
    return checks


# No body met a wall or another body, in the rows of a log and between them.
#
# Between two rows a distance changes by no more than the bodies travel. Where that is not enough, the chord
# between both configurations is divided; bodies are as near to it as ``Between`` says.

PARTS = (2, 4, 8, 16, 32, 64)
"""Into how many parts the chord between two rows is divided, tried in this order."""

ENOUGH = 0.5
"""A bound between two rows need not be tighter than this fraction of the distance at the rows [-]."""

CLEARANCE_ROUNDING = 1e-8
"""Distances that are computed twice may differ by so much [m]: a millionth of what matters."""


@dataclass(frozen=True)
class _Distance:
    """One distance that must stay positive.

    Attributes:
        name: What it is between, in words.
        array: Name of the log's array that holds the smallest of its kind.
        measure: From configurations (T, 3 + n) to signed distances (T,) [m].
        stages: Stages that change it, with a bound of how much for each unit of the axis; an axis may occur
            twice.
        moves: Whether it changes with the object's position, too.
    """

    name: str
    array: str
    measure: Callable[[FloatArray], FloatArray]
    stages: tuple[tuple[TreeJoint, float], ...]
    moves: bool

    def travel(self, amounts: FloatArray) -> FloatArray:
        """Bound of the distance's change for changes (m, 3 + n) of the coordinates, shape (m,) [m]."""
        amounts = np.abs(amounts)
        total = np.hypot(amounts[:, 0], amounts[:, 1]) if self.moves else np.zeros(len(amounts))
        for stage, lever in self.stages:
            total = total + lever * amounts[:, 3 + stage.index]
        return total


def check_clearances(
    rows: Rows, between: Between, problem: PlanningProblem, progress: Progress | None
) -> tuple[Check, Check]:
    """Check that nothing touched, and that the stated clearances are the smallest distances.

    Raises:
        RefusalError: Names array, index and time, and what may have touched.
    """
    distances = _distances(problem, rows.z)
    smallest = {name: np.full(len(rows.z), np.inf) for name in ("workspace_clearance", "body_clearance")}
    least = np.inf
    for k, distance in enumerate(distances):
        gaps = distance.measure(rows.z)
        rows.require(gaps > 0.0, distance.array, f"{distance.name} touch")
        least = min(least, _least_between(rows, between, distance, gaps))
        smallest[distance.array] = np.minimum(smallest[distance.array], gaps)
        if progress is not None:
            progress("checking clearances", (k + 1) / len(distances))
    for name, expected in smallest.items():
        rows.require_same(name, expected, CLEARANCE_ROUNDING)
    least_logged = float(min(values.min() for values in smallest.values()))
    count = len(distances)
    return (
        Check(
            "no body met a wall or another body",
            count * len(rows.z),
            least_logged,
            "m, smallest",
            tuple(smallest),
        ),
        Check("nor did one between two rows", count * len(rows.steps), least, "m, a lower bound"),
    )


def least_distances(problem: PlanningProblem, z: FloatArray) -> FloatArray:
    """Return the smallest distance of any body to a wall or to a body that it must not meet.

    Args:
        problem: The floor and the team.
        z: Configurations (x, y, theta, q...), shape (T, 3 + n).

    Returns:
        Distances, zero or less where something touches, shape (T,) [m].
    """
    least: FloatArray = np.min([distance.measure(z) for distance in _distances(problem, z)], axis=0)
    return least


def _least_between(rows: Rows, between: Between, distance: _Distance, gaps: FloatArray) -> float:
    """Lower bound of a distance between rows [m]; refuses a log that is too sparse for one above zero."""
    ends = np.minimum(gaps[1:], gaps[:-1])
    bounds = 0.5 * (gaps[1:] + gaps[:-1] - distance.travel(between.speeds * rows.steps[:, None]))
    beside = distance.travel(between.deviations)
    for parts in PARTS:
        coarse = np.flatnonzero(bounds < ENOUGH * ends)
        if not len(coarse):
            break
        weights = np.linspace(0.0, 1.0, parts + 1)[:, None, None]
        z, chord = rows.z[coarse], rows.z[coarse + 1] - rows.z[coarse]
        inner = distance.measure((z + weights * chord).reshape(-1, z.shape[1])).reshape(parts + 1, -1)
        nearest = (0.5 * (inner[1:] + inner[:-1])).min(axis=0) - 0.5 * distance.travel(chord) / parts
        bounds[coarse] = np.maximum(bounds[coarse], nearest - beside[coarse])
    text = f"is {{:.3g}} s after the row before, too long to know that {distance.name} did not touch between"
    rows.require(bounds > 0.0, "times", text, rows.steps, first=1)
    return float(bounds.min(initial=np.inf))


def _distances(problem: PlanningProblem, z: FloatArray) -> list[_Distance]:
    """All distances that must stay positive: of every solid to the walls, and of pairs of solids."""
    tree, floor = problem.tree, problem.workspace
    solids, walls, most = team_solids(tree), floor.boundary, np.abs(z).max(axis=0)
    distances = [
        _Distance(
            f"{solid.name} and a wall",
            "workspace_clearance",
            partial(_wall_gaps, solid, floor, walls),
            _moved_by(solid, len(solid.stages), most),
            moves=True,
        )
        for solid in solids
    ]
    for first, second, *counts in checked_pairs(tree, solids):
        stages = (*_moved_by(first, counts[0], most), *_moved_by(second, counts[1], most))
        name, measure = f"{first.name} and {second.name}", partial(_gaps, first, second)
        distances.append(_Distance(name, "body_clearance", measure, stages, moves=False))
    return distances


def _moved_by(solid: Solid, count: int, most: FloatArray) -> tuple[tuple[TreeJoint, float], ...]:
    stages = solid.stages[:count]
    reach = float(np.hypot(*solid.vertices.T).max()) + solid.radius
    return tuple(zip(stages, levers(reach, stages, most).tolist(), strict=True))


def _shapes(solid: Solid, z: FloatArray) -> NDArray[np.object_]:
    """A solid without its radius in W, for every configuration, shape (T,)."""
    points = points_in_world(solid.vertices, solid.stages, z)
    if points.shape[1] > 2:
        return np.asarray(shapely.polygons(points), dtype=np.object_)
    kind = shapely.linestrings if points.shape[1] == 2 else shapely.points
    return np.asarray(kind(points if points.shape[1] == 2 else points[:, 0]), dtype=np.object_)


def _gaps(first: Solid, second: Solid, z: FloatArray) -> FloatArray:
    """Distance of two solids, zero or less where they touch, shape (T,) [m]."""
    apart: FloatArray = shapely.distance(_shapes(first, z), _shapes(second, z))
    return apart - first.radius - second.radius


def _wall_gaps(solid: Solid, floor: Polygon, walls: BaseGeometry, z: FloatArray) -> FloatArray:
    """Distance of a solid to the walls, negative where its first vertex is outside the floor, (T,) [m]."""
    corner = points_in_world(solid.vertices[:1], solid.stages, z)[:, 0]
    inside = shapely.contains_xy(floor, corner[:, 0], corner[:, 1])
    gaps: FloatArray = np.where(inside, shapely.distance(_shapes(solid, z), walls) - solid.radius, -np.inf)
    return gaps
