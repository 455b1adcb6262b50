"""A plan and a log with plausible numbers, made without planner or simulation, for tests of what is drawn."""

from __future__ import annotations

import numpy as np
from shapely import Point, Polygon

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Cell, Plan, Transition
from coop_drake.answers.problem import PlanningProblem
from coop_drake.laws.gains import TransitionGains

SECONDS = 12.0
WAY = np.array([[0.9, 2.0], [0.9, 5.8], [3.4, 5.8], [5.0, 4.4], [5.0, 8.0]])


def synthetic_plan(problem: PlanningProblem) -> Plan:
    """One square cell around every point of the way."""
    n = len(problem.start) - 3
    theta = np.linspace(problem.start[2], problem.goal_pose[2], len(WAY))
    cells = tuple(_cell(point, angle, n) for point, angle in zip(WAY, theta, strict=True))
    return Plan(
        cells=cells,
        transitions=tuple(_transition(cell, point) for cell, point in zip(cells, WAY, strict=True)),
        start=problem.start,
        goal_pose=problem.goal_pose,
        goal_joints=problem.goal_joints,
        joint_names=tuple(joint.name for joint in problem.tree.joints),
        gain_set="scheduled",
    )


def synthetic_log(problem: PlanningProblem, *, samples: int = 400) -> SimulationLog:
    """The object slides along the way while it turns and every arm waves."""
    n, robots = len(problem.start) - 3, 1 + max(joint.robot for joint in problem.tree.joints)
    times = np.linspace(0.0, SECONDS, samples)
    phase = times / SECONDS
    cell_index = np.minimum((phase * len(WAY)).astype(np.int64), len(WAY) - 1)
    knots = np.linspace(0.0, 1.0, len(WAY))
    theta = problem.start[2] + phase * (problem.goal_pose[2] - problem.start[2])
    pose = np.column_stack([np.interp(phase, knots, WAY[:, 0]), np.interp(phase, knots, WAY[:, 1]), theta])
    joints = np.column_stack([0.5 * np.sin(2 * np.pi * phase + k) for k in range(n)])
    axes = np.column_stack([theta, joints])
    width = 0.1 + 0.3 * np.exp(-5.0 * ((phase * len(WAY)) % 1.0))[:, None]
    wave = np.sin(np.outer(times, np.arange(1, 4)))
    wrenches = np.stack([(k + 1.0) * wave for k in range(robots)], axis=1)
    margin = 0.05 + 0.04 * np.cos(times)
    return SimulationLog(
        times=times,
        cell_index=cell_index,
        transition_start=times[np.searchsorted(cell_index, cell_index)],
        object_pose=pose,
        object_twist=np.gradient(pose, times, axis=0),
        base_poses=np.stack([pose + np.array([0.1 * k, 0.0, 0.0]) for k in range(robots)], axis=1),
        joints=joints,
        joint_rates=np.gradient(joints, times, axis=0),
        accelerations=np.zeros((samples, 3 + n)),
        governor_position=pose[:, :2] + 0.02,
        governor_spread=np.zeros(samples),
        funnel_lower=axes - width,
        funnel_upper=axes + width,
        energy_margin=margin,
        object_wrench=wrenches.sum(axis=1),
        commanded_wrenches=wrenches,
        measured_wrenches=wrenches,
        grasp_error=np.zeros(samples),
        base_wrenches=2.0 * wrenches,
        joint_torques=0.1 * joints,
        ready_margins=np.tile(np.cos(times)[:, None], (1, robots)),
        held=np.zeros(samples),
        clock_lag=np.zeros(samples),
        workspace_clearance=margin + 0.1,
        body_clearance=margin + 0.2,
        cell_clearance=margin,
        funnel_margin=np.broadcast_to(width.min(axis=1), times.shape),
        slice_margin=np.broadcast_to(width.min(axis=1), times.shape),
        acceleration_error=np.full(samples, 1e-13),
        wrench_error=np.full(samples, 1e-12),
        reached=True,
        violation="",
        joint_names=tuple(joint.name for joint in problem.tree.joints),
        robot_names=tuple(f"robot_{k}" for k in range(robots)),
    )


def _cell(point: np.ndarray, angle: float, n: int) -> Cell:
    def square(half: float) -> Polygon:
        return Point(point).buffer(half, cap_style="square")

    centre = np.concatenate([[angle], np.zeros(n)])
    return Cell(centre - 0.6, centre + 0.6, square(0.45))


def _transition(cell: Cell, target: np.ndarray) -> Transition:
    ones = np.ones(len(cell.lower))
    gains = TransitionGains(
        50.0, 7.0, 5.0, 1e-3, "quintic", 4.0 * ones, 0.1 * ones, 1.0, 8.0, 2.0, 0.02, 0.1, 0.1 * ones
    )
    return Transition(
        target=target,
        goal_lower=cell.lower + 0.1,
        goal_upper=cell.upper - 0.1,
        inradius=0.4,
        neck=0.3,
        length=2.0,
        estimated_time=3.0,
        only_angles=False,
        gains=gains,
        path=np.array([target, target]),
    )
