"""The compiled loop: a whole run from the start until the team has arrived, or something is violated."""

from __future__ import annotations

from coop_drake.compiled_loop.arrays import LoopCells, LoopDepartures, LoopMemory, LoopNominal, LoopPlant
from coop_drake.compiled_loop.motion import EARLY, MotionRoom, advance, motion_room
from coop_drake.compiled_loop.robots import (
    RobotRoom,
    follow_axes,
    heard_cell,
    judge,
    lead,
    remember_switch,
    report,
    robot_room,
)
from coop_drake.compiled_loop.sensing import measure, receive
from coop_drake.compiled_loop.watching import (
    ENDED,
    RUNS,
    WatchRoom,
    begin_figures,
    left_by_all,
    watch,
    watch_room,
)
from coop_drake.jit import compiled
from coop_drake.laws.actuators import limit_efforts
from coop_drake.laws.channels import carry_reports
from coop_drake.laws.departure import quiet_margin
from coop_drake.laws.nominal_axes import carry_axes
from coop_drake.laws.random_draws import uniform_pair
from coop_drake.laws.robot_dynamics import estimate_object
from coop_drake.systems.nominal_kernels import step_nominal
from coop_drake.systems.team_kernels import FusedTeam
from coop_drake.tree.pose import FloatArray


@compiled
def run_loop(
    cells: LoopCells, team: FusedTeam, plant: LoopPlant, nominal: LoopNominal, departures: LoopDepartures,
    memory: LoopMemory,
) -> FloatArray:  # fmt: skip
    """Run a transport and return its figures, see ``watching``.

    Args:
        cells: The plan's cells.
        team: The robots' models of themselves.
        plant: The simulated team.
        nominal: The nominal motions.
        departures: What departs from the ideal team.
        memory: The state at the start; it is changed.
    """
    room, motion, seen = robot_room(memory), motion_room(team.yaws.size, plant), watch_room(plant)
    figures = begin_figures()
    _run_on(cells, team, plant, nominal, departures, memory, room, motion, seen, figures)
    return figures


@compiled(borrows=True)
def _run_on(
    cells: LoopCells, team: FusedTeam, plant: LoopPlant, nominal: LoopNominal, departures: LoopDepartures,
    memory: LoopMemory, room: RobotRoom, motion: MotionRoom, seen: WatchRoom, figures: FloatArray,
) -> None:  # fmt: skip
    """Write the figures of a run.

    All arrays are arguments. References to an array that a function allocates itself are counted wherever
    the array is passed on, which took a tenth of a run.
    """
    sample = 0
    watch(sample, cells, team, plant, nominal, departures, memory, seen, figures)
    while figures[ENDED] == RUNS:
        update(cells, team, nominal, departures, room, memory, sample)
        advance(sample, team, plant, departures, memory, motion)
        sample += 1
        watch(sample, cells, team, plant, nominal, departures, memory, seen, figures)


@compiled(borrows=True)
def update(
    cells: LoopCells, team: FusedTeam, nominal: LoopNominal, departures: LoopDepartures, room: RobotRoom,
    memory: LoopMemory, sample: int,
) -> None:  # fmt: skip
    """Do what happens at a sample: all read what was before, as in Drake."""
    measure(sample, sample, team, departures, memory, room.errors)
    for i in range(room.held.size):
        room.held[i] = memory.efforts[0, i]
    for k in range(team.yaws.size):
        time = sample * departures.times[0]
        compute(k, sample, sample, time, False, cells, team, nominal, departures, room, memory)
        _fail(k, sample, room.held, team, departures, memory)
    for k in range(team.yaws.size):
        first, last = team.first[2, k], team.first[2, k + 1]
        own = memory.efforts[0, 3 * k + first : 3 * k + 3 + last]
        limit_efforts(departures.limits[2 * k + first : 2 * k + 2 + last], own)
    now = sample % memory.current.shape[0]
    cell = int(memory.current[now, 0])
    _lead_on(sample, cell, room.law, cells, nominal, departures, memory)
    following = memory.current[(sample + 1) % memory.current.shape[0]]
    following[0], following[1] = memory.current[now, 0], memory.current[now, 1]
    if cell + 1 < cells.rows.shape[0] and left_by_all(cell, memory):
        following[0], following[1] = cell + 1, sample * departures.times[0]
    _send(sample, departures, memory, room.arrivals)


@compiled(borrows=True)
def compute(
    k: int, sample: int, number: int, now: float, whole: bool, cells: LoopCells, team: FusedTeam,
    nominal: LoopNominal, departures: LoopDepartures, room: RobotRoom, memory: LoopMemory,
) -> None:  # fmt: skip
    """Do what robot k computes at a sample: its effort, its report, its own p_G, and the law of its axes.

    Args:
        k: The robot.
        sample: Number of the sample, or of the next one between two samples.
        number: Number of the control period whose noise and losses there are now.
        now: Time of the run [s].
        whole: As in ``report``.
        cells: The plan's cells.
        team: The robots' models.
        nominal: The nominal motions.
        departures: What departs.
        room: Receives the accelerations of the law of its axes, and what the robot tells the log.
        memory: What changes.
    """
    governed, begin, joints = room.governed, k + team.first[2, k], team.first[2, k + 1] - team.first[2, k]
    measured = room.robots[0, : 2 * (3 + joints)]
    receive(k, sample, number, team, departures, memory, room.pose, measured)
    chain = team.chains[team.first[0, k] : team.first[0, k + 1]]
    estimate_object(chain, team.loads[k, :2], measured, room.pose, room.seen[0])
    cell, time = heard_cell(k, sample, now, departures, memory)
    lead(k, sample, cell, time, cells, team, nominal, departures, memory, room)
    row = follow_axes(k, sample, cell, time, cells, team, nominal, departures, memory, room)
    led, led_robot = room.seen[row], room.robots[row, : measured.size]
    margin = report(k, sample, cell, time, led, led_robot, cells, nominal, departures, memory, begin, whole)
    if cell + 1 == cells.rows.shape[0]:
        own = 3 * begin - 2 * team.first[2, k]
        newest = memory.recent[sample % memory.recent.shape[0], own : own + 3 + joints]
        for i in range(newest.size):
            newest[i] = room.pose[i] if i < 3 else measured[i]
    if nominal.levels.size:
        judge(k, sample, now, team, cells, nominal, departures, memory, room, measured)
        margin = quiet_margin(margin, memory.alarms[k, 0])
    memory.reports[0, k, 0], memory.reports[0, k, 1] = cell, margin
    if margin >= 0.0:
        remember_switch(k, cell, time, led, led_robot, cells, memory, begin)
    memory.governors[k, 0] += departures.times[0] * governed[0]
    memory.governors[k, 1] += departures.times[0] * governed[1]


@compiled(borrows=True)
def _fail(
    k: int, sample: int, held: FloatArray, team: FusedTeam, departures: LoopDepartures, memory: LoopMemory
) -> None:
    """Let robot k fall silent, and its motors fail, while it is said to."""
    period, begin = departures.times[0], departures.silences[0, k]
    early = EARLY * period
    if not begin - early <= sample * period < departures.silences[1, k] - early:
        for i in range(memory.reports.shape[2]):
            memory.reports[1, k, i] = memory.reports[0, k, i]
        return
    for i in range(memory.reports.shape[2]):
        memory.reports[0, k, i] = memory.reports[1, k, i]
    own, motors = 3 * k + team.first[2, k], departures.silences[2, k]
    for i in range(own, own + 3 + team.first[2, k + 1] - team.first[2, k]):
        if motors > 0.0:
            memory.efforts[0, i] = held[i] if motors == 1.0 else 0.0


@compiled(borrows=True)
def _lead_on(
    sample: int, cell: int, law: FloatArray, cells: LoopCells, nominal: LoopNominal,
    departures: LoopDepartures, memory: LoopMemory,
) -> None:  # fmt: skip
    """Carry the nominal motions over a period."""
    period = departures.times[0]
    if nominal.flow.size:
        ring, first = memory.nominal.shape[0], cells.first
        edges = cells.governed[first[0, cell] : first[0, cell + 1]]
        flat = cells.flats[first[2, cell] : first[2, cell + 1]]
        field = cells.fields[first[3, cell] : first[3, cell + 1]]
        now, later = memory.nominal[sample % ring], memory.nominal[(sample + 1) % ring]
        step_nominal(
            cells.rows[cell], edges, flat, field, nominal.flow, period, nominal.position[0], 1.0, now, later
        )
    if nominal.axis_gains.size:
        ring = memory.axes.shape[0]
        now_axes, later_axes = memory.axes[sample % ring], memory.axes[(sample + 1) % ring]
        carry_axes(now_axes, law, period, nominal.axis_gains[2], later_axes)


@compiled(borrows=True)
def _send(sample: int, departures: LoopDepartures, memory: LoopMemory, arrivals: FloatArray) -> None:
    """Carry every robot's channel of reports over a period; ``arrivals`` is room for one."""
    loss, repeat = departures.probabilities[2], departures.probabilities[3]
    for k in range(memory.channels.shape[0]):
        arrives, repeated = True, False
        if loss > 0.0 or repeat > 0.0:
            chances = uniform_pair(departures.seeds[k, 0], sample)
            arrives, repeated = chances[0] >= loss, chances[1] < repeat
        kept = memory.channels[k]
        carry_reports(kept, memory.reports[0, k], arrives, repeated, departures.periods[2], arrivals)
        for i in range(kept.shape[0]):
            for j in range(kept.shape[1]):
                kept[i, j] = arrivals[i, j]
