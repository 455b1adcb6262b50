"""What the robots of a sampled team would show to the log at any instant."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.compiled_loop.arrays import LoopCells, LoopDepartures, LoopMemory, LoopNominal
from coop_drake.compiled_loop.looping import compute
from coop_drake.compiled_loop.robots import ACCELERATION, COMMAND, ENERGY, heard_cell, robot_room
from coop_drake.compiled_loop.sensing import measure
from coop_drake.compiled_loop.watching import left_by_all
from coop_drake.laws.axis_table import write_bounds
from coop_drake.systems.nominal_kernels import nominal_margin
from coop_drake.systems.team_kernels import FusedTeam, read_own
from coop_drake.tree.pose import FloatArray

SHOWN = 20
"""Numbers that a robot shows: pose of its base (3), p_G (2), Delta E, its report (2), what its monitor says
(3), then from ``WANTED`` on the object's desired acceleration (3) and the command of the end effector (6)."""

POSE, GOVERNOR, MARGIN, READY, ALARM, WANTED = 0, 3, 5, 6, 8, 11
"""Where they stand."""


@compiled
def tell(
    cells: LoopCells, team: FusedTeam, nominal: LoopNominal, departures: LoopDepartures, memory: LoopMemory,
    sample: int, number: int, now: float, instant: FloatArray, shown: FloatArray, bounds: FloatArray,
) -> None:  # fmt: skip
    """Write what the blocks of all robots and the cell planner would show now, before a sample's updates.

    Args:
        cells: The plan's cells.
        team: The robots' models.
        nominal: The nominal motions.
        departures: What departs.
        memory: What changes; it is changed as by a sample, so that it must be a copy.
        sample: Number of the sample, or of the next one between two samples.
        number: Number of the control period that ``now`` is in.
        now: Time of the run [s].
        instant: Receives index of the cell, time of its entry [s], 1 where the team has arrived, (3,).
        shown: Receives what ``SHOWN`` lists of every robot, shape (N, ``SHOWN``).
        bounds: Receives lower and upper bounds of the funnels of all axes, shape (2, M) [rad or m].
    """
    current, robots = memory.current[sample % memory.current.shape[0]], team.yaws.size
    cell = int(current[0])
    arrived = cell + 1 == cells.rows.shape[0] and left_by_all(cell, memory)
    instant[0], instant[1], instant[2] = current[0], current[1], 1.0 if arrived else 0.0
    room, robot = robot_room(memory), np.empty(memory.state.size)
    told = room.told
    measure(sample, number, team, departures, memory, room.errors)
    led = memory.nominal[sample % memory.nominal.shape[0]]
    for k in range(robots):
        row, begin = shown[k], k + team.first[2, k]
        end = begin + 1 + team.first[2, k + 1] - team.first[2, k]
        heard, time = heard_cell(k, sample, now, departures, memory)
        read_own(k, team.places, team.first, team.base_chains, team.yaws, memory.state, robot)
        row[POSE : POSE + 3] = robot[:3]
        row[GOVERNOR : GOVERNOR + 2] = led[4:6] if nominal.flow.size else memory.governors[k]
        compute(k, sample, number, now, True, cells, team, nominal, departures, room, memory)
        row[MARGIN] = told[ENERGY]
        if nominal.flow.size:
            edges = cells.governed[cells.first[0, heard] : cells.first[0, heard + 1]]
            row[MARGIN] = nominal_margin(edges, cells.numbers[heard, 1], led)
        row[READY : READY + 2] = memory.reports[0, k]
        row[ALARM : ALARM + 3] = memory.alarms[k, :3]
        row[WANTED:] = told[ACCELERATION : COMMAND + 6]
        own = np.empty(2 * (end - begin))
        write_bounds(cells.tables[heard, begin:end], time, own)
        bounds[0, begin:end], bounds[1, begin:end] = own[: end - begin], own[end - begin :]
