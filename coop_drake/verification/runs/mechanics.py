"""Check a run's efforts by mechanics: Newton's and Euler's equations of the object and of every robot.

About the object's origin, the sum of m a and of I w' + r x m a over all bodies of a robot is the wrench of
its base less that at its grasp. Of the bodies that a joint carries outwards, the same sum less the base's
wrench, taken along the joint, is the joint's effort but for its damping, its rotor's inertia, and a dry
friction up to the scenario's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.component_tree import ComponentTree, TreeJoint
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.grasps import about_object
from coop_drake.verification.runs.placement import points_in_world, turns
from coop_drake.verification.runs.planar import cross, left, turned
from coop_drake.verification.runs.rows import Rows
from coop_drake.verification.runs.setup import BodyMass, RunSetup
from coop_drake.verification.solids import Stage, component_stages

SAME = 1e-9
"""Forces that are computed twice may differ by this share of the sizes of their terms [-]."""


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
    position, acceleration, turning = _moved(body.p_CBcm, component_stages(tree, body.component), rows)
    force = body.mass * acceleration
    moment = body.inertia * turning + cross(position, force)
    return np.column_stack((force, moment)), np.abs(force).sum(axis=1) + np.abs(moment)


def _moved(
    point: FloatArray, stages: Sequence[Stage], rows: Rows
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A point relative to the object's origin, its acceleration (T, 2) and its body's w' (T,) in W."""
    count = len(rows.z)
    x, v, a = np.tile(point, (count, 1)), np.zeros((count, 2)), np.zeros((count, 2))
    turning = np.zeros(count)
    for stage in stages:
        i = 2 + stage.axis
        q, rate, second = (
            stage.scale * values[:, i] for values in (rows.z, rows.rates, rows.log.accelerations)
        )
        if stage.kind == "prismatic":
            x, v, a = (old + new[:, None] * stage.direction for old, new in ((x, q), (v, rate), (a, second)))
        else:
            x, v, a = (turned(old, q) for old in (x, v, a))
            w = rate[:, None]
            a = a + 2.0 * w * left(v) + second[:, None] * left(x) - w * w * x
            v = v + w * left(x)
            turning = turning + second
        angle = np.full(count, stage.X_PJ.angle)
        x, v, a = (turned(old, angle) for old in (x, v, a))
        x = x + np.array([stage.X_PJ.x, stage.X_PJ.y])
    return x, a + rows.log.accelerations[:, :2], turning


def _base(rows: Rows, robot: int) -> FloatArray:
    """A base's wrench in W about the object's origin, shape (T, 3) [N, N m]."""
    wrench, place = rows.log.base_wrenches[:, robot], rows.log.base_poses[:, robot, :2]
    moment = wrench[:, 2] + cross(place - rows.z[:, :2], wrench[:, :2])
    return np.column_stack((wrench[:, :2], moment))
