"""Transports in an open room with plans written by hand: no search, no Drake."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin, sqrt

import numpy as np
from shapely import Point, Polygon, box

from coop_drake.answers.motion import Motion
from coop_drake.answers.plan import Cell, Plan, Transition
from coop_drake.laws import GainSet, ScheduledGains, transition_gains

ROOM = box(0.0, 0.0, 10.0, 7.0)
START_POSE = (3.0, 3.0, 0.2)
GOAL_POSE = (5.2, 3.6, 0.7)
POSITION_TOLERANCE = 0.01
ANGLE_TOLERANCE = 0.02

# Positions, interval of the angle and of every joint of each cell; neighbours overlap in all of them.
CELLS = (
    (box(2.2, 2.2, 4.4, 4.6), (0.0, 0.4), (-0.3, 0.3)),
    (box(3.2, 2.4, 5.0, 4.8), (0.2, 0.6), (-0.1, 0.5)),
    (box(4.0, 2.6, 6.2, 4.8), (0.4, 1.0), (0.0, 0.6)),
)


def small_plan(joint_names: tuple[str, ...], gain_set: GainSet | None = None) -> Plan:
    """The plan for a team with these joints, gains scheduled unless told otherwise."""
    n = len(joint_names)
    cells = tuple(_cell(polygon, angle, joint, n) for polygon, angle, joint in CELLS)
    start = np.array([*START_POSE, *[0.0] * n])
    return plan_by_hand(cells, start, np.array(GOAL_POSE), joint_names, gain_set)


def round_trip(joint_names: tuple[str, ...], cells: int = 30) -> Plan:
    """A plan once round the middle of the room, all axes to and fro, through many cells."""
    n = len(joint_names)
    walked = []
    for turn in np.linspace(0.0, 2.0 * pi, cells):
        x, y = 5.0 - 1.5 * cos(turn), 3.5 - 1.5 * sin(turn)
        angle, joint = 0.3 * sin(3.0 * turn), 0.15 * sin(2.0 * turn)
        polygon = box(x - 0.8, y - 0.8, x + 0.8, y + 0.8)
        walked.append(_cell(polygon, (angle - 0.25, angle + 0.25), (joint - 0.25, joint + 0.25), n))
    start = np.array([3.5, 3.5, 0.0, *[0.0] * n])
    return plan_by_hand(tuple(walked), start, np.array([3.4, 3.6, 0.1]), joint_names)


def plan_by_hand(
    cells: tuple[Cell, ...],
    start: np.ndarray,
    goal_pose: np.ndarray,
    joint_names: tuple[str, ...],
    gain_set: GainSet | None = None,
) -> Plan:
    """The plan through some cells, joints free at the end, each target in the middle of an overlap.

    Args:
        cells: Each overlaps the next in all axes.
        start: z in the first of them.
        goal_pose: In the last.
        joint_names: Names of the joints.
        gain_set: Gains, scheduled unless told otherwise.
    """
    gain_set = gain_set if gain_set is not None else ScheduledGains()
    transitions = []
    position, resting = start[:2], start[2:]
    for index in range(len(cells)):
        transition = _transition(cells, index, position, resting, goal_pose, gain_set)
        transitions.append(transition)
        position, resting = transition.target, 0.5 * (transition.goal_lower + transition.goal_upper)
    return Plan(
        cells=cells,
        transitions=tuple(transitions),
        start=start,
        goal_pose=goal_pose,
        goal_joints=(None,) * len(joint_names),
        joint_names=joint_names,
        gain_set="by hand",
    )


def stiffer_and_stiffer(plan: Plan) -> Plan:
    """The plan with a K of its own in every cell, so that it matters whose K a law takes."""
    transitions = []
    for i, transition in enumerate(plan.transitions):
        gains, factor = transition.gains, 1.0 + 0.5 * i
        stiffer = replace(
            gains,
            stiffness=factor * gains.stiffness,
            damping=sqrt(factor) * gains.damping,
            governor_gain=sqrt(factor) * gains.governor_gain,
        )
        transitions.append(replace(transition, gains=stiffer))
    return replace(plan, transitions=tuple(transitions))


def _cell(polygon: Polygon, angle: tuple[float, float], joint: tuple[float, float], n: int) -> Cell:
    lower, upper = np.array([angle[0], *[joint[0]] * n]), np.array([angle[1], *[joint[1]] * n])
    return Cell(lower, upper, polygon)


def _transition(
    cells: tuple[Cell, ...],
    index: int,
    position: np.ndarray,
    resting: np.ndarray,
    goal_pose: np.ndarray,
    gain_set: GainSet,
) -> Transition:
    cell, last = cells[index], index == len(cells) - 1
    if last:
        target = goal_pose[:2]
        inradius = POSITION_TOLERANCE
        lower, upper = cell.lower.copy(), cell.upper.copy()
        lower[0], upper[0] = goal_pose[2] - ANGLE_TOLERANCE, goal_pose[2] + ANGLE_TOLERANCE
    else:
        region = cell.tidied & cells[index + 1].tidied
        target = np.array(region.centroid.coords[0])
        inradius = region.exterior.distance(Point(target))
        lower = np.maximum(cell.lower, cells[index + 1].lower)
        upper = np.minimum(cell.upper, cells[index + 1].upper)
    neck = min(cell.tidied.exterior.distance(Point(p)) for p in (position, target))
    gains = transition_gains(
        gain_set,
        clearance=neck,
        slice_lower=cell.lower,
        slice_upper=cell.upper,
        goal_lower=lower,
        goal_upper=upper,
        resting=resting,
    )
    length = float(np.linalg.norm(target - position))
    return Transition(
        target=target,
        goal_lower=lower,
        goal_upper=upper,
        inradius=inradius,
        neck=neck,
        length=length,
        estimated_time=0.6 + length / (3.0 * neck),
        only_angles=False,
        gains=gains,
        path=np.array([position, target]),
    )


def with_motion(plan: Plan) -> Plan:
    """The plan with a motion by hand that waits at its start: for tests of blocks, which no cell judges."""
    still, cells = np.tile(plan.start, (7, 1)), len(plan.cells)
    begins = np.linspace(0.0, 3.0, cells)
    windows = np.stack([begins, np.append(begins[1:] + 0.5, 4.0)], axis=1)
    pulls = ((100.0, 20.0), (100.0, 20.0))
    return replace(plan, motion=Motion(still, 1.0, windows, np.zeros(cells), 0.128, 0.1, 1.0, pulls))
