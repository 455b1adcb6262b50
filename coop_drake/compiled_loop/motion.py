"""How the team of the compiled loop moves within a control period: actuators, floor, pushes and dynamics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled_loop.arrays import LoopDepartures, LoopMemory, LoopPlant
from coop_drake.jit import compiled
from coop_drake.laws.actuators import lag_behind
from coop_drake.laws.friction import base_friction
from coop_drake.laws.sticking import StickingRoom, stick, sticking_room
from coop_drake.laws.team_dynamics import TeamWork, team_accelerations, team_work
from coop_drake.systems.team_kernels import FusedTeam, read_own
from coop_drake.tree.pose import FloatArray

BEGIN, END = 4, 5
"""Columns of the times of a push."""

EARLY = 1e-6
"""Share of a period by which an interval that begins at a sample may seem to begin later [-], by rounding."""


class MotionRoom(NamedTuple):
    """Room for what ``advance`` computes on the way, given so that it need not be made at every sample.

    Attributes:
        acting: Efforts at the sample, shape (3 N + n,) [N, N m].
        states: State at the stage, at the sample, and what it changes by, shape (3, 2 (3 + n)).
        slopes: Accelerations, shape (3 + n,).
        wrenches: On bases and object, shape (N + 1, 3) [N, N m].
        efforts: Of the joints, at the places of their rates, shape (3 + n,) [N m or N].
        robot: State of a robot with the most joints that there can be, shape (2 (3 + n),).
        work: Of the equations of motion.
        sticking: Of blocked wheels and of the friction of joints.
        blocked: 1 for bases with blocked wheels, else 0, shape (N,).
    """

    acting: FloatArray
    states: FloatArray
    slopes: FloatArray
    wrenches: FloatArray
    efforts: FloatArray
    robot: FloatArray
    work: TeamWork
    sticking: StickingRoom
    blocked: FloatArray


@compiled
def motion_room(robots: int, plant: LoopPlant) -> MotionRoom:
    """Return room for a team of so many robots."""
    n = plant.tree.shape[0] + 2
    acting, states, wrenches = np.empty(3 * robots + n - 3), np.empty((3, 2 * n)), np.empty((robots + 1, 3))
    sticking, blocked = sticking_room(plant.tree.shape[0], robots), np.zeros(robots)
    return MotionRoom(
        acting, states, np.empty(n), wrenches, np.zeros(n), np.empty(2 * n), team_work(plant.tree), sticking,
        blocked,
    )  # fmt: skip


@compiled(borrows=True)
def advance(
    sample: int, team: FusedTeam, plant: LoopPlant, departures: LoopDepartures, memory: LoopMemory,
    room: MotionRoom,
) -> None:  # fmt: skip
    """Carry the team's state and its actuators' efforts over a period, by the classical Runge-Kutta method.

    Efforts follow what is held as exponentials, exactly. A step of 5 ms errs by 1e-8 of the distances moved.
    """
    period, n = departures.times[0], memory.state.size // 2
    sticks = departures.friction[0] > 0.0 or departures.friction[1] > 0.0
    state, start, change, slopes = room.states[0], room.states[1], room.states[2], room.slopes
    for i in range(room.acting.size):
        room.acting[i] = memory.efforts[1, i]
    for i in range(2 * n):
        state[i], start[i], change[i] = memory.state[i], memory.state[i], 0.0
    for k in range(room.blocked.size):
        room.blocked[k] = 1.0 if _within(departures.blocked[:, k], sample, period) else 0.0
        sticks = sticks or room.blocked[k] > 0.0
    for stage in range(4):
        ahead = 0.0 if stage == 0 else period if stage == 3 else 0.5 * period
        if stage != 2:  # Efforts are those of stage 1.
            lag_behind(departures.times[2], ahead, memory.efforts[0], room.acting, memory.efforts[1])
        _drive(sample, sample * period + ahead, state, team, plant, departures, memory, room)
        if sticks:
            stick(
                plant.tree, plant.bases, plant.places, room.blocked, departures.friction, room.efforts,
                departures.floor[2], state, room.work, room.sticking, slopes, room.wrenches,
            )  # fmt: skip
        else:
            team_accelerations(
                plant.tree, plant.bases, plant.places, room.wrenches, room.efforts, departures.floor[2],
                state, room.work, slopes,
            )  # fmt: skip
        weight = period / 6.0 if stage in (0, 3) else period / 3.0
        further = 0.0 if stage == 3 else period if stage == 2 else 0.5 * period
        for i in range(n):
            change[i] += weight * state[n + i]
            change[n + i] += weight * slopes[i]
            state[i] = start[i] + further * state[n + i]
            state[n + i] = start[n + i] + further * slopes[i]
    for i in range(2 * n):
        memory.state[i] += change[i]


@compiled(borrows=True)
def _within(times: FloatArray, sample: int, period: float) -> bool:
    """Whether a period begins in an interval of time [s]."""
    early = EARLY * period
    return bool(times[0] - early <= sample * period < times[1] - early)


@compiled(borrows=True)
def _drive(
    sample: int, time: float, state: FloatArray, team: FusedTeam, plant: LoopPlant,
    departures: LoopDepartures, memory: LoopMemory, room: MotionRoom,
) -> None:  # fmt: skip
    """Write the wrenches on bases and object, and the efforts of all joints.

    Args:
        sample: Number of the sample that began the period.
        time: Now [s].
        state: The team's, in the order of the plant, shape (2 (3 + n),).
        team: Where joints stand in it.
        plant: The simulated team.
        departures: What departs.
        memory: Holds the efforts.
        room: Receives wrenches and efforts.
    """
    robots, n, wrenches, efforts = team.yaws.size, state.size // 2, room.wrenches, room.efforts
    for i in range(3):
        wrenches[robots, i] = 0.0
    for k in range(robots):
        first, own = team.first[2, k], 3 * k + team.first[2, k]
        left = 1.0
        if _within(departures.slips[:2, k], sample, departures.times[0]):
            left -= departures.slips[2, k]
        for i in range(3):
            wrenches[k, i] = left * memory.efforts[1, own + i]
        for i in range(team.first[2, k + 1] - first):
            limit, effort = plant.strongest[first + i], memory.efforts[1, own + 3 + i]
            efforts[team.places[1, 3 + first + i] - n] = min(max(effort, -limit), limit)
    if departures.floor[0] > 0.0 or departures.floor[1] > 0.0:
        _add_friction(state, team, departures, wrenches, room.robot)
    for push in range(departures.pushes.shape[0]):
        row = departures.pushes[push]
        if row[BEGIN] <= time < row[END]:
            for i in range(3):
                wrenches[int(row[0]), i] += row[1 + i]


@compiled(borrows=True)
def _add_friction(
    state: FloatArray, team: FusedTeam, departures: LoopDepartures, wrenches: FloatArray, robot: FloatArray
) -> None:
    """Add the friction of every base; ``robot`` is room for its state."""
    for k in range(team.yaws.size):
        read_own(k, team.places, team.first, team.base_chains, team.yaws, state, robot)
        n = 3 + team.first[2, k + 1] - team.first[2, k]
        fx, fy = base_friction(robot[n], robot[n + 1], departures.floor[0], departures.floor[1])
        wrenches[k, 0] += fx
        wrenches[k, 1] += fy
