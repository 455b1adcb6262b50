"""Small plans at random: crooked corridors of boxes, slices that must be left, gains of both kinds."""

from __future__ import annotations

import numpy as np
from shapely import box

from coop_drake.answers.plan import Cell, Plan
from coop_drake.laws import FixedGains, GainSet, ScheduledGains
from tests.support.small_plan import ANGLE_TOLERANCE, START_POSE, plan_by_hand

TURNS = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


def random_gains(rng: np.random.Generator) -> GainSet:
    """Table 2's gains or scheduled ones, each within a factor of two of what ships."""
    factor = np.exp(rng.uniform(-np.log(2.0), np.log(2.0), 4))
    if rng.random() < 0.3:
        return FixedGains(stiffness=50.0 * factor[0], damping=5.0 * factor[1], governor_gain=5.0 * factor[2])
    return ScheduledGains(
        wall_stiffness=20.0 * factor[0],
        damping_factor=1.4 * factor[1],
        governor_factor=1.2 * factor[2],
        age_phase=0.4 * factor[3],
    )


def random_plan(rng: np.random.Generator, joint_names: tuple[str, ...], cells: int = 4) -> Plan:
    """A plan from the pose where ``small_plan`` starts.

    Args:
        rng: Draws widths (16 to 80 cm), lengths (20 to 60 cm), turns, slices, goals and gains.
        joint_names: Names of the joints.
        cells: Number of cells.
    """
    n = len(joint_names)
    corners, direction = [np.array(START_POSE[:2])], int(rng.integers(4))
    for _ in range(cells):
        corners.append(corners[-1] + rng.uniform(0.2, 0.6) * TURNS[direction % 4])
        direction += int(rng.integers(-1, 2))
    halves = rng.uniform(0.08, 0.4, cells)
    slices = [_slices(rng, START_POSE[2], cells, 0.6), *(_slices(rng, 0.0, cells, 0.3) for _ in range(n))]
    made = []
    for index, half in enumerate(halves):
        low, high = np.minimum(*corners[index : index + 2]), np.maximum(*corners[index : index + 2])
        polygon = box(*(low - half), *(high + half))
        lower, upper = np.array([axis[index] for axis in slices]).T
        made.append(Cell(lower, upper, polygon))
    last = slices[0][-1]
    angle = rng.uniform(last[0] + 2.0 * ANGLE_TOLERANCE, last[1] - 2.0 * ANGLE_TOLERANCE)
    start = np.array([*START_POSE, *[0.0] * n])
    goal = np.array([*corners[-1], angle])
    return plan_by_hand(tuple(made), start, goal, joint_names, random_gains(rng))


def _slices(rng: np.random.Generator, start: float, cells: int, widest: float) -> list[tuple[float, float]]:
    """Intervals of one axis, the first round the start, each overlapping the next at one of its ends."""
    width = widest * rng.uniform(0.25, 1.0)
    lower = start - width * rng.uniform(0.15, 0.85)
    slices = [(lower, lower + width)]
    for _ in range(1, cells):
        lower, upper = slices[-1]
        width = widest * rng.uniform(0.25, 1.0)
        overlap = rng.uniform(0.25, 0.6) * min(width, upper - lower)
        slices.append(
            (upper - overlap, upper - overlap + width)
            if rng.random() < 0.5
            else (lower + overlap - width, lower + overlap)
        )
    return slices
