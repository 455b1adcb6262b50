"""Check efforts, wrenches and speeds of a run by kinematics and mechanics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.component_tree import ComponentTree, TreeJoint
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.kinematics import (
    Stages,
    component_stages,
    cross,
    moved,
    points_in_world,
    turned,
    turns,
)
from coop_drake.verification.runs.rows import BodyMass, Rows, RunSetup

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
    """Check every measured speed against its limit; None where there is none."""
    limits = problem.limits
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
