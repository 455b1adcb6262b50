"""Check that bases and joints kept their limits in a run, by kinematics of the checker's own."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.planar import left, turned
from coop_drake.verification.runs.rows import Rows
from coop_drake.verification.solids import Stage, component_stages


def check_run_speeds(rows: Rows, problem: PlanningProblem) -> Check | None:
    """Check every measured speed against its limit; None where there is none."""
    limits = problem.limits
    if not limits.any:
        return None
    speeds, turns = np.empty(rows.log.base_poses.shape[:2]), np.empty(rows.log.base_poses.shape[:2])
    for k, (component, point) in enumerate(zip(limits.base_components, limits.base_points, strict=True)):
        velocity, turns[:, k] = _motion(np.array(point), component_stages(problem.tree, component), rows)
        speeds[:, k] = np.hypot(velocity[:, 0], velocity[:, 1])
    least, count = 1.0, 0
    for name, found, most in (
        ("base_poses", speeds, limits.base_speeds),
        ("base_poses", np.abs(turns), limits.turn_rates),
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


def _motion(point: FloatArray, stages: tuple[Stage, ...], rows: Rows) -> tuple[FloatArray, FloatArray]:
    """Velocity of a point of a component in W (T, 2) [m/s], and the rate of its angle (T,) [rad/s]."""
    count = len(rows.z)
    x, v, turning = np.tile(point, (count, 1)), np.zeros((count, 2)), np.zeros(count)
    for stage in stages:
        q, rate = (stage.scale * values[:, 2 + stage.axis] for values in (rows.z, rows.rates))
        if stage.kind == "prismatic":
            x, v = x + q[:, None] * stage.direction, v + rate[:, None] * stage.direction
        else:
            x, v = turned(x, q), turned(v, q)
            v, turning = v + rate[:, None] * left(x), turning + rate
        angle = np.full(count, stage.X_PJ.angle)
        x, v = turned(x, angle) + np.array([stage.X_PJ.x, stage.X_PJ.y]), turned(v, angle)
    return v + rows.rates[:, :2], turning
