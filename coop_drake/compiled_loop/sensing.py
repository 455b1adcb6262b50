"""What the robots of the compiled loop measure: with constant errors, noise, delay and losses."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled_loop.arrays import LoopDepartures, LoopMemory
from coop_drake.jit import compiled
from coop_drake.laws.channels import NOTHING, carry_measurements
from coop_drake.laws.measurement_errors import shift_back, write_errors
from coop_drake.laws.random_draws import uniform_pair
from coop_drake.systems.team_kernels import FusedTeam, read_own
from coop_drake.tree.pose import FloatArray

LOST_POSE, POSE_NOISE, STATE_NOISE = 1, 5, 6
"""Uses of seeds: losses of measured poses, those of measured states being the next one, and noise of both."""


@compiled(borrows=True)
def measure(
    sample: int, number: int, team: FusedTeam, departures: LoopDepartures, memory: LoopMemory,
    room: FloatArray,
) -> None:  # fmt: skip
    """Write what every robot's sensors measure at a sample, before delay and losses.

    Args:
        sample: Number of the sample, or of the next one between two samples.
        number: Number of the control period whose noise there is now.
        team: The robots' models.
        departures: What departs.
        memory: What changes.
        room: Room for the errors of a robot's state.
    """
    now = sample % memory.poses.shape[0]
    for k in range(team.yaws.size):
        own = 3 * k + team.first[2, k]
        size = 3 + team.first[2, k + 1] - team.first[2, k]
        pose, robot = memory.poses[now, k], memory.states[now, 2 * own : 2 * (own + size)]
        for i in range(3):
            pose[i] = memory.state[team.places[0, i]] + departures.biases[k, i]
        read_own(k, team.places, team.first, team.base_chains, team.yaws, memory.state, robot)
        for i in range(size, size + 3):
            robot[i] *= departures.odometry[k]
        if departures.shifts[k] != 0.0:
            _shift(sample, 3 * k, departures.shifts[k], pose, memory.exact)
            _shift(sample, 3 * team.yaws.size + 2 * own, departures.shifts[k], robot, memory.exact)
        _err(departures.seeds[k, POSE_NOISE], number, departures.errors[:3], pose, room)
        begin = 3 + 2 * own
        sizes = departures.errors[begin : begin + robot.size]
        _err(departures.seeds[k, STATE_NOISE], number, sizes, robot, room)


@compiled(borrows=True)
def _shift(sample: int, first: int, share: float, values: FloatArray, exact: FloatArray) -> None:
    """Show what a wrong clock measures, and keep what there is from ``first`` on; see ``shift_back``."""
    now, before = exact[sample % 2], exact[(sample + 1) % 2]
    for i in range(values.size):
        now[first + i] = values[i]
        if sample == 0:
            before[first + i] = values[i]
    shift_back(values, before[first : first + values.size], share)


@compiled(borrows=True)
def _err(seed: int, sample: int, sizes: FloatArray, values: FloatArray, room: FloatArray) -> None:
    """Add the errors of a measurement, unless there are none."""
    largest = 0.0
    for i in range(values.size):
        largest = max(largest, sizes[i, 0], sizes[i, 1])
    if largest > 0.0:
        errors = room[: values.size]
        write_errors(seed, sizes[:, 0], sizes[:, 1:], sample, errors)
        for i in range(values.size):
            values[i] += errors[i]


@compiled(borrows=True)
def receive(
    k: int, sample: int, number: int, team: FusedTeam, departures: LoopDepartures, memory: LoopMemory,
    pose: FloatArray, robot: FloatArray,
) -> None:  # fmt: skip
    """Write the pose and the state that robot k has, and carry its lines over a period.

    Args:
        k: The robot.
        sample: This and the next four arguments are those of ``measure``.
        number: Number of the control period.
        team: The robots' models.
        departures: What departs.
        memory: What changes.
        pose: Receives the object's pose, shape (3,) [m, m, rad].
        robot: Receives the robot's own state (z_k, z_k'), shape (2 (3 + n_k),).
    """
    own = 2 * (3 * k + team.first[2, k])
    seen = max(sample - departures.periods[0], 0) % memory.poses.shape[0]
    for i in range(3):
        pose[i] = memory.poses[seen, k, i]
    for i in range(robot.size):
        robot[i] = memory.states[seen, own + i]
    if departures.probabilities[0] > 0.0 or departures.probabilities[1] > 0.0:
        for kind, values in ((0, pose), (1, robot)):
            if sample == 0:
                _fill(memory.lines[k, kind], values)
            _pass(departures.seeds[k, LOST_POSE + kind], number, departures, memory.lines[k, kind], values)


@compiled(borrows=True)
def _fill(line: FloatArray, values: FloatArray) -> None:
    """Let a line hold the first values that are measured."""
    for row in range(line.shape[0]):
        line[row, 0] = NOTHING
        for i in range(values.size):
            line[row, 1 + i] = values[i]


@compiled
def _pass(seed: int, number: int, departures: LoopDepartures, line: FloatArray, values: FloatArray) -> None:
    """Replace measured values by those that have arrived, and carry the line over a period."""
    measured, following = np.zeros(line.shape[1] - 1), np.empty(line.shape)
    for i in range(values.size):
        measured[i] = values[i]
    chances = uniform_pair(seed, number)
    lost, late = chances[0] < departures.probabilities[0], chances[1] < departures.probabilities[1]
    if lost or late:
        for i in range(values.size):
            values[i] = line[0, 1 + i]
    carry_measurements(line, number, measured, lost, late, following)
    for row in range(line.shape[0]):
        for i in range(line.shape[1]):
            line[row, i] = following[row, i]
