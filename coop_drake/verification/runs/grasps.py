"""Check the grasps of a run: bases stand where they put them, and wrenches at them add up."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.placement import points_in_world, turns
from coop_drake.verification.runs.planar import cross, turned
from coop_drake.verification.runs.rows import Rows
from coop_drake.verification.runs.setup import RunSetup
from coop_drake.verification.solids import Stage, component_stages

SAME = 1e-9
"""Wrenches that are computed twice may differ by this share of their sizes [-]."""

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


def _offset(rows: Rows, stages: tuple[Stage, ...], robot: int) -> FloatArray:
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
