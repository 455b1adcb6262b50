"""The compiled loop: a whole run from the start until the team has arrived, or something is violated."""

from __future__ import annotations

from coop_drake.compiled_loop.arrays import (
    LoopCells,
    LoopDepartures,
    LoopMemory,
    LoopNominal,
    LoopPlant,
    LoopTeam,
    MotionRoom,
    RobotRoom,
    WatchRoom,
)
from coop_drake.compiled_loop.robots import EARLY, compute, talk
from coop_drake.compiled_loop.watching import ENDED, RUNS, left_by_all, watch
from coop_drake.jit import compiled
from coop_drake.laws import words
from coop_drake.laws.actuators import lag_behind, limit_efforts
from coop_drake.laws.departures import act_on_wrenches
from coop_drake.laws.measurements import carry_reports, uniform_pair
from coop_drake.laws.robot_dynamics import read_robot
from coop_drake.laws.team_dynamics import stick
from coop_drake.tree.arrays import FloatArray


@compiled(borrows=True)
def run_loop(
    cells: LoopCells, team: LoopTeam, plant: LoopPlant, nominal: LoopNominal, departures: LoopDepartures,
    memory: LoopMemory, room: RobotRoom, motion: MotionRoom, seen: WatchRoom, figures: FloatArray,
) -> None:  # fmt: skip
    """Run a transport.

    Args:
        cells: The plan's cells.
        team: The robots' models of themselves.
        plant: The simulated team.
        nominal: The nominal motions.
        departures: What departs from the ideal team.
        memory: The state at the start; it is changed.
        room: This and the next two arguments are what ``rooms_of`` gives.
        motion: Room for ``advance``.
        seen: Room for ``watch``.
        figures: What ``begin_figures`` gives; receives the figures of the run, see ``watching``.
    """
    sample = 0
    while True:
        watch(sample, cells, team, plant, nominal, departures, memory, seen, figures)
        if figures[ENDED] != RUNS:
            break
        update(cells, team, nominal, departures, room, memory, sample)
        advance(sample, team, plant, departures, memory, motion)
        sample += 1


@compiled(inlined=True, borrows=True)
def update(
    cells: LoopCells, team: LoopTeam, nominal: LoopNominal, departures: LoopDepartures, room: RobotRoom,
    memory: LoopMemory, sample: int,
) -> None:  # fmt: skip
    """Do all that is done at a sample, and carry what is between the robots over a period.

    A team that passes has no cell planner and no reports.
    """
    period, channels = departures.times[0], memory.channels
    instant, early = sample * period, EARLY * period
    for i in range(room.held.size):
        room.held[i] = memory.efforts[0, i]
    if nominal.points.size:
        talk(sample, instant, nominal, departures, memory)
    compute(sample, sample, sample * period, False, cells, team, nominal, departures, room, memory)

    # Robots that fall silent, with motors that fail; limits of actuators.
    for k in range(team.yaws.size):
        first, last = team.first[2, k], team.first[2, k + 1]
        begin, end, motors = departures.silences[0, k], departures.silences[1, k], departures.silences[2, k]
        silent = begin - early <= instant < end - early
        stands, other = (1, 0) if silent else (0, 1)  # While a robot is silent, its last report stands.
        for i in range(memory.reports.shape[2]):
            memory.reports[other, k, i] = memory.reports[stands, k, i]
        own = memory.efforts[0, 3 * k + first : 3 * k + 3 + last]
        if silent and motors > 0.0:
            for i in range(own.size):
                own[i] = room.held[3 * k + first + i] if motors == 1.0 else 0.0
        limit_efforts(departures.limits[2 * k + first : 2 * k + 2 + last], own)
    if nominal.points.size:  # What is said now; of who is silent, what was said before.
        ring = memory.said.shape[0]
        for k in range(team.yaws.size + 1):
            silent = departures.silences[0, k] - early <= instant < departures.silences[1, k] - early
            for i in range(words.WORD_SIZE):
                before = memory.said[(sample - 1) % ring, k, i]
                memory.said[sample % ring, k, i] = before if silent else memory.words[k, k, i]
        return

    # The cell planner, which reads what was before, as in Drake.
    entered = memory.current[sample % memory.current.shape[0]]
    following = memory.current[(sample + 1) % memory.current.shape[0]]
    cell = int(entered[0])
    following[0], following[1] = entered[0], entered[1]
    if cell + 1 < cells.rows.shape[0] and left_by_all(cell, channels):
        following[0], following[1] = cell + 1, sample * period

    # The channels of reports.
    loss, repeat = departures.probabilities[2], departures.probabilities[3]
    for k in range(channels.shape[0]):
        arrives, repeated = True, False
        if loss > 0.0 or repeat > 0.0:
            chances = uniform_pair(departures.seeds[k, 0], sample)
            arrives, repeated = chances[0] >= loss, chances[1] < repeat
        delay, arrivals = departures.periods[2], room.arrivals
        carry_reports(channels[k], memory.reports[0, k], arrives, repeated, delay, arrivals)
        for i in range(arrivals.shape[0]):
            for j in range(arrivals.shape[1]):
                channels[k, i, j] = arrivals[i, j]


@compiled(inlined=True, borrows=True)
def advance(
    sample: int, team: LoopTeam, plant: LoopPlant, departures: LoopDepartures, memory: LoopMemory,
    room: MotionRoom,
) -> None:  # fmt: skip
    """Carry the team's state and its actuators' efforts over a period, by the classical Runge-Kutta method.

    Efforts follow what is held as exponentials, exactly. A step of 5 ms errs by 1e-8 of the distances moved.
    """
    period, n, world = departures.times[0], memory.state.size // 2, departures.world
    instant, early, floor = sample * period, EARLY * period, world.floor
    state, start, change, slopes = room.states[0], room.states[1], room.states[2], room.slopes
    robots, wrenches, efforts = team.yaws.size, room.wrenches, room.efforts
    for i in range(room.acting.size):
        room.acting[i] = memory.efforts[1, i]
    for i in range(2 * n):
        state[i], start[i], change[i] = memory.state[i], memory.state[i], 0.0
    for stage in range(4):
        ahead = 0.0 if stage == 0 else period if stage == 3 else 0.5 * period
        if stage != 2:  # Efforts are those of stage 1.
            lag_behind(departures.times[2], ahead, memory.efforts[0], room.acting, memory.efforts[1])
        for i in range(3):
            wrenches[robots, i] = 0.0
        for k in range(robots):
            first, own = team.first[2, k], 3 * k + team.first[2, k]
            for i in range(3):
                wrenches[k, i] = memory.efforts[1, own + i]
            for i in range(team.first[2, k + 1] - first):
                limit, effort = plant.strongest[first + i], memory.efforts[1, own + 3 + i]
                efforts[team.places[1, 3 + first + i] - n] = min(max(effort, -limit), limit)
            if floor[0] > 0.0 or floor[1] > 0.0:
                joints = team.places[:, 3 + first : 3 + team.first[2, k + 1]]
                base = team.base_chains[team.first[1, k] : team.first[1, k + 1]]
                read_robot(base, team.yaws[k], joints, room.motion, state, room.robot)
                rates = 3 + team.first[2, k + 1] - first
                room.velocities[k, 0], room.velocities[k, 1] = room.robot[rates], room.robot[rates + 1]
        act_on_wrenches(world, instant + early, instant + ahead, room.velocities, wrenches)
        stick(
            plant.tree, plant.bases, plant.places, world.blocked, instant + early, world.friction, efforts,
            floor[2], state, room.work, room.sticking, slopes, wrenches,
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
