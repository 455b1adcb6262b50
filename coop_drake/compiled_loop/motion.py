"""How the team of the compiled loop moves within a control period: actuators, floor, pushes and dynamics."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.compiled_loop.arrays import LoopDepartures, LoopMemory, LoopPlant
from coop_drake.laws.actuators import lag_behind
from coop_drake.laws.friction import base_friction
from coop_drake.laws.team_dynamics import team_accelerations, team_work
from coop_drake.systems.team_kernels import FusedTeam, read_own
from coop_drake.tree.pose import FloatArray

BEGIN, END = 4, 5
"""Columns of the times of a push."""


@compiled
def advance(
    sample: int, team: FusedTeam, plant: LoopPlant, departures: LoopDepartures, memory: LoopMemory
) -> None:
    """Carry the team's state and its actuators' efforts over a period, by the classical Runge-Kutta method.

    Efforts follow what is held as exponentials, exactly. A step of 5 ms errs by 1e-8 of the distances moved.
    """
    period, n = departures.times[0], memory.state.size // 2
    acting, state, start = memory.efforts[1].copy(), memory.state.copy(), memory.state.copy()
    change, slopes, work = np.zeros(2 * n), np.empty(n), team_work(plant.tree.shape[0])
    wrenches, efforts = np.empty((team.yaws.size + 1, 3)), np.zeros(n)
    for stage in range(4):
        ahead = 0.0 if stage == 0 else period if stage == 3 else 0.5 * period
        _follow(ahead, acting, departures, memory)
        _drive(sample * period + ahead, state, team, plant, departures, memory, wrenches, efforts)
        team_accelerations(
            plant.tree, plant.bases, plant.places, wrenches, efforts, departures.floor[2], state, work, slopes
        )
        weight = period / 6.0 if stage in (0, 3) else period / 3.0
        further = 0.0 if stage == 3 else period if stage == 2 else 0.5 * period
        for i in range(n):
            change[i] += weight * state[n + i]
            change[n + i] += weight * slopes[i]
            state[i] = start[i] + further * state[n + i]
            state[n + i] = start[n + i] + further * slopes[i]
    for i in range(2 * n):
        memory.state[i] += change[i]
    _follow(period, acting, departures, memory)


@compiled
def _follow(ahead: float, acting: FloatArray, departures: LoopDepartures, memory: LoopMemory) -> None:
    """Write the efforts that act a time after the sample, at which ``acting`` acted."""
    lag_behind(departures.times[2], ahead, memory.efforts[0], acting, memory.efforts[1])


@compiled
def _drive(
    time: float, state: FloatArray, team: FusedTeam, plant: LoopPlant, departures: LoopDepartures,
    memory: LoopMemory, wrenches: FloatArray, efforts: FloatArray,
) -> None:  # fmt: skip
    """Write the wrenches on bases and object, and the efforts of all joints.

    Args:
        time: Now [s].
        state: The team's, in the order of the plant, shape (2 (3 + n),).
        team: Where joints stand in it.
        plant: The simulated team.
        departures: What departs.
        memory: Holds the efforts.
        wrenches: Receives forces in W and torques, shape (N + 1, 3) [N, N m].
        efforts: Receives the efforts at the places of the rates, shape (3 + n,) [N m or N].
    """
    robots, n = team.yaws.size, state.size // 2
    wrenches[robots] = 0.0
    for k in range(robots):
        first, own = team.first[2, k], 3 * k + team.first[2, k]
        for i in range(3):
            wrenches[k, i] = memory.efforts[1, own + i]
        for i in range(team.first[2, k + 1] - first):
            limit, effort = plant.strongest[first + i], memory.efforts[1, own + 3 + i]
            efforts[team.places[1, 3 + first + i] - n] = min(max(effort, -limit), limit)
    if departures.floor[0] > 0.0 or departures.floor[1] > 0.0:
        _add_friction(state, team, departures, wrenches)
    for push in departures.pushes:
        if push[BEGIN] <= time < push[END]:
            for i in range(3):
                wrenches[int(push[0]), i] += push[1 + i]


@compiled
def _add_friction(
    state: FloatArray, team: FusedTeam, departures: LoopDepartures, wrenches: FloatArray
) -> None:
    """Add the friction of every base."""
    robot = np.empty(state.size)
    for k in range(team.yaws.size):
        read_own(k, team.places, team.first, team.base_chains, team.yaws, state, robot)
        n = 3 + team.first[2, k + 1] - team.first[2, k]
        fx, fy = base_friction(robot[n], robot[n + 1], departures.floor[0], departures.floor[1])
        wrenches[k, 0] += fx
        wrenches[k, 1] += fy
