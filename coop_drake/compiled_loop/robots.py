"""What one robot of the compiled loop computes at a sample, by the laws that Drake's blocks call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled_loop.arrays import LoopCells, LoopDepartures, LoopMemory, LoopNominal
from coop_drake.jit import compiled
from coop_drake.laws.arrival import arrival_margin
from coop_drake.laws.axis_table import bounds_of, track_axes, write_jumps
from coop_drake.laws.departure import alarm_at, axis_level, largest_departure
from coop_drake.laws.load_sharing import end_effector_command
from coop_drake.laws.nominal_axes import carry_axes, place_on_axes, pull_axes
from coop_drake.laws.robot_dynamics import robot_effort
from coop_drake.systems.governor_kernels import govern
from coop_drake.systems.nominal_kernels import accelerate_along, show_nominal
from coop_drake.systems.ready_kernels import axes_ready, robot_arrived, robot_ready, robot_ready_along
from coop_drake.systems.team_kernels import FusedTeam
from coop_drake.tree.pose import FloatArray

TOLD, ENERGY, ACCELERATION, COMMAND = 10, 0, 1, 4
"""What a robot tells the log beside its report, and where: Delta E where no nominal motion leads [m^2/s^2],
the object's desired acceleration [m/s^2, rad/s^2], then what ``end_effector_command`` writes."""

ON_TIME = np.array([0.0, 1.0, 0.0])
"""A clock that never stood still: lag [s], pace [-] and the derivative of the pace [1/s]."""


class RobotRoom(NamedTuple):
    """Room for what one robot computes at a sample, given so that it need not be made every time.

    Attributes:
        pose: The object's pose as the robot knows it, shape (3,).
        seen: The object's state as the robot knows it, then on the nominal axes of now, and of when efforts
            act, shape (3, 6).
        robots: The robot's own state in the same three ways, shape (3, 2 (3 + n)).
        governed: What ``lead`` writes, shape (4,) [m/s, m/s^2].
        told: What the robot tells the log, see ``TOLD``.
        law: What the law of all axes asks for, shape (M,).
        pulled: That of the robot's with the pull to the nominal motion, shape (M,).
        later: Nominal axes when efforts act, shape (3, M).
        fading: The jumps of the robot's axes that fade in the cell, shape (M,).
        levels: Levels of all axes and of their rates, shape (2, M).
        held: Efforts before the sample, shape (3 N + n,) [N, N m].
        errors: Of one measurement, shape (2 (3 + n),).
        arrivals: What a channel of reports holds next, of its shape.
    """

    pose: FloatArray
    seen: FloatArray
    robots: FloatArray
    governed: FloatArray
    told: FloatArray
    law: FloatArray
    pulled: FloatArray
    later: FloatArray
    fading: FloatArray
    levels: FloatArray
    held: FloatArray
    errors: FloatArray
    arrivals: FloatArray


@compiled
def robot_room(memory: LoopMemory) -> RobotRoom:
    """Return room for a team."""
    axes, state, channel = memory.jumps.size, memory.state.size, memory.channels.shape
    seen, robots, later, efforts = np.empty((3, 6)), np.empty((3, state)), np.empty((3, axes)), memory.efforts
    return RobotRoom(
        np.empty(3), seen, robots, np.empty(4), np.empty(TOLD), np.empty(axes), np.empty(axes), later,
        np.empty(axes), np.empty((2, axes)), np.empty(efforts.shape[1]), np.empty(state),
        np.empty((channel[1], channel[2])),
    )  # fmt: skip


@compiled(borrows=True)
def heard_cell(
    k: int, sample: int, now: float, departures: LoopDepartures, memory: LoopMemory
) -> tuple[int, float]:
    """Return the cell that robot k knows, and the time since its entry by its own clock [s].

    Args:
        k: The robot.
        sample: Number of the sample, or of the next one between two samples.
        now: Time of the run [s].
        departures: What departs.
        memory: What changes.
    """
    heard = sample - int(departures.hearing[1, k])
    if heard < 0:  # it has heard nothing yet, and begins in the first cell
        return 0, now
    current = memory.current[heard % memory.current.shape[0]]
    return int(current[0]), now - (current[1] - departures.hearing[0, k])


@compiled(borrows=True)
def lead(
    k: int, sample: int, cell: int, time: float, cells: LoopCells, team: FusedTeam, nominal: LoopNominal,
    departures: LoopDepartures, memory: LoopMemory, room: RobotRoom,
) -> None:  # fmt: skip
    """Write p_G' as robot k moves its own p_G, and the desired acceleration of the object's origin.

    Args:
        k: The robot.
        sample: Number of the sample.
        cell: The cell that it knows.
        time: Time since its entry [s].
        cells: The plan's cells.
        team: The robots' models.
        nominal: The nominal motions.
        departures: What departs.
        memory: What changes.
        room: Holds the object's state as the robot knows it; receives both, p_G' being zero where a nominal
            motion leads, and otherwise Delta E.
    """
    seen, governed = room.seen[0], room.governed
    if nominal.flow.size:
        governed[0], governed[1] = 0.0, 0.0
        ring = memory.nominal.shape[0]
        now, then = memory.nominal[sample % ring], max(sample - departures.periods[0], 0) % ring
        accelerate_along(team.tracking, seen, now[4:6], now, memory.nominal[then], governed[2:])
    else:
        first, p_G = cells.first, memory.governors[k]
        edges = cells.governed[first[0, cell] : first[0, cell + 1]]
        flat = cells.flats[first[2, cell] : first[2, cell + 1]]
        field = cells.fields[first[3, cell] : first[3, cell + 1]]
        room.told[ENERGY] = govern(cells.rows[cell], edges, flat, field, time, seen, p_G, governed)


@compiled(borrows=True)
def command(
    k: int, linear: FloatArray, axes: FloatArray, seen: FloatArray, robot: FloatArray, team: FusedTeam,
    efforts: FloatArray, told: FloatArray,
) -> None:  # fmt: skip
    """Write the effort that gives end effector and joints of robot k the desired accelerations.

    Args:
        k: The robot.
        linear: Desired acceleration of the object's origin, shape (2,) [m/s^2].
        axes: Desired accelerations of its angle and of the joints, shape (1 + n_k,).
        seen: The object's state with which they become efforts, shape (6,).
        robot: The robot's own, shape (2 (3 + n_k),).
        team: The robots' models.
        efforts: Those of all robots; receives the effort.
        told: Receives the object's desired acceleration and the command of the end effector, see ``TOLD``.
    """
    wanted, own = told[COMMAND:], 3 * k + team.first[2, k]
    told[ACCELERATION], told[ACCELERATION + 1], told[ACCELERATION + 2] = linear[0], linear[1], axes[0]
    chain = team.chains[team.first[0, k] : team.first[0, k + 1]]
    end_effector_command(team.loads[k], seen, linear, axes, wanted)
    robot_effort(chain, robot, wanted, axes, efforts[own : own + 2 + axes.size])


@compiled(borrows=True)
def follow_axes(
    k: int, sample: int, cell: int, time: float, cells: LoopCells, team: FusedTeam, nominal: LoopNominal,
    departures: LoopDepartures, memory: LoopMemory, room: RobotRoom,
) -> int:  # fmt: skip
    """Write the effort of robot k and what the law of its axes asks for.

    Args:
        k: This and the next three arguments are those of ``lead``.
        sample: Number of the sample.
        cell: The cell.
        time: Time since its entry [s].
        cells: This and the next four arguments are those of ``lead``.
        team: The robots' models.
        nominal: The nominal motions.
        departures: What departs.
        memory: What changes.
        room: Holds the states of object and robot as the robot knows them, and the desired acceleration of
            the object's origin; receives the accelerations of the law, and what ``command`` tells.

    Returns:
        The row of ``room.seen`` and of ``room.robots`` with the states on which the law acts, and by which
        the robot is ready.
    """
    begin, end = k + team.first[2, k], k + 1 + team.first[2, k + 1]
    size, fades = 2 * (2 + end - begin), memory.jumped[k] == cell
    rows, law, seen, robot = (
        cells.tables[cell, begin:end],
        room.law[begin:end],
        room.seen[0],
        room.robots[0, :size],
    )
    linear, jumps = room.governed[2:], room.fading[begin:end]
    for i in range(begin, end):
        room.fading[i] = memory.jumps[i] if fades else 0.0
    if not nominal.axis_gains.size:
        track_axes(rows, time, ON_TIME, jumps, seen, robot, law)
        command(k, linear, law, seen, robot, team, memory.efforts[0], room.told)
        return 0
    ring, mounting = memory.axes.shape[0], nominal.mountings[begin:end]
    now = memory.axes[sample % ring, :, begin:end]
    then = memory.axes[max(sample - departures.periods[0], 0) % ring, :2, begin:end]
    led, led_robot = room.seen[1], room.robots[1, :size]
    _place(now, mounting, seen, robot, led, led_robot)
    track_axes(rows, time, ON_TIME, jumps, led, led_robot, law)
    pulled, later = room.pulled[begin:end], room.later[:, begin:end]
    gains, lag = nominal.axis_gains, nominal.axis_gains[2]
    pull_axes(law, seen, robot, then, (gains[0], gains[1]), pulled)
    carry_axes(now, law, 0.5 * departures.times[0] + lag, lag, later)
    ahead, robot_ahead = room.seen[2], room.robots[2, :size]
    _place(later, mounting, seen, robot, ahead, robot_ahead)
    command(k, linear, pulled, ahead, robot_ahead, team, memory.efforts[0], room.told)
    return 1


@compiled(borrows=True)
def _place(
    axes: FloatArray, mounting: FloatArray, seen: FloatArray, robot: FloatArray, led: FloatArray,
    led_robot: FloatArray,
) -> None:  # fmt: skip
    """Write the states of object and robot with the angles and rates of their nominal axes."""
    for i in range(6):
        led[i] = seen[i]
    for i in range(robot.size):
        led_robot[i] = robot[i]
    led[2], led[5] = axes[0, 0], axes[1, 0]
    place_on_axes(axes, mounting, led_robot)


@compiled
def report(
    k: int, sample: int, cell: int, time: float, seen: FloatArray, robot: FloatArray, cells: LoopCells,
    nominal: LoopNominal, departures: LoopDepartures, memory: LoopMemory, begin: int, whole: bool,
) -> float:  # fmt: skip
    """Return the margin with which robot k is ready; of a negative one only its sign unless ``whole``.

    Args:
        k: This and the next three arguments are those of ``lead``.
        sample: Number of the sample.
        cell: The cell.
        time: Time since its entry [s].
        seen: The object's state by which it judges, shape (6,).
        robot: Its own, shape (2 (3 + n_k),).
        cells: This and the next three arguments are those of ``lead``.
        nominal: The nominal motions.
        departures: What departs.
        memory: What changes.
        begin: Its first row among all axes.
        whole: Whether the margin is wanted that its blocks would report.
    """
    end, following = begin + robot.size // 2 - 2, cell + 1
    if following == cells.rows.shape[0]:
        return _report_arrival(k, sample, seen, robot, cells, nominal, memory, begin)
    own, after = cells.tables[cell, begin:end], cells.tables[following, begin:end]
    margin = axes_ready(own, after, False, time, seen, robot)
    if margin < 0.0 and not whole:  # the position is not judged in vain
        return margin
    edges = cells.governed[cells.first[0, following] : cells.first[0, following + 1]]
    stiffness, inradius = cells.numbers[following, 1], cells.numbers[cell, 0]
    if not nominal.flow.size:
        return robot_ready(
            own, after, edges, stiffness, inradius, cells.goal, cells.tolerance, False, time, seen, robot,
            memory.governors[k],
        )  # fmt: skip
    shown, state = np.empty(6), memory.nominal[sample % memory.nominal.shape[0]]
    here = cells.governed[cells.first[0, cell] : cells.first[0, cell + 1]]
    speed, periods = nominal.position[0], nominal.position[1]
    period, target = departures.times[0], cells.numbers[cell, 3:]
    show_nominal(here, cells.numbers[cell, 1], target, period, periods, speed, state, shown)
    return robot_ready_along(
        own, after, edges, stiffness, inradius, cells.goal, cells.tolerance, False, time, seen, robot,
        state[4:6], shown,
    )  # fmt: skip


@compiled(borrows=True)
def judge(
    k: int, sample: int, now: float, team: FusedTeam, cells: LoopCells, nominal: LoopNominal,
    departures: LoopDepartures, memory: LoopMemory, room: RobotRoom, robot: FloatArray,
) -> None:  # fmt: skip
    """Write what the monitor of robot k says, by what it has measured.

    Args:
        k: The robot.
        sample: Number of the sample, or of the next one between two samples.
        now: Time of the run [s].
        team: The robots' models.
        cells: The plan's cells.
        nominal: The nominal motions.
        departures: What departs.
        memory: What changes.
        room: Holds the object's state as the robot measures it.
        robot: Its own, shape (2 (3 + n_k),).
    """
    begin, size = k + team.first[2, k], 1 + team.first[2, k + 1] - team.first[2, k]
    age, own = int(departures.periods[0]), size if nominal.axis_alarms.shape[2] else 0
    made = max(sample - age, 0)
    axes = memory.axes[made % memory.axes.shape[0], :2, begin : begin + own]
    stated, levels = nominal.axis_alarms, room.levels[:, begin : begin + own]
    cell, time = heard_cell(k, made, made * departures.times[0] if age else now, departures, memory)
    for i in range(own):
        levels[0, i], levels[1, i] = stated[cell, 0, begin + i], stated[cell, 1, begin + i]
        if sample >= age:
            lower, upper = bounds_of(cells.tables[cell, begin + i], time)[:2]
            reserve = nominal.reserves[begin + i]
            levels[0, i] = axis_level(levels[0, i], reserve, axes[0, i], lower, upper)
    led, alarms = memory.nominal[made % memory.nominal.shape[0]], memory.alarms[k]
    chain = team.chains[team.first[0, k] : team.first[0, k + 1]]
    mounting = nominal.mountings[begin : begin + size]
    share, which = largest_departure(
        chain, team.loads[k], mounting, robot, room.seen[0], led, axes, nominal.levels, levels, nominal.unseen
    )
    alarms[0], alarms[1], alarms[2] = alarm_at(share, now, alarms[3]), share, which
    if share > 1.0:
        alarms[3] = now


@compiled(borrows=True)
def _report_arrival(
    k: int, sample: int, seen: FloatArray, robot: FloatArray, cells: LoopCells, nominal: LoopNominal,
    memory: LoopMemory, begin: int,
) -> float:  # fmt: skip
    """Return the margin with which robot k has arrived, in the last cell; arguments as in ``report``."""
    axes, rows = robot.size // 2 - 2, memory.recent.shape[0]
    own, first = 2 * k + begin, k + begin
    arrival = arrival_margin(
        cells.places[own : own + 2 + axes], cells.rooms[0, first : first + 1 + axes],
        cells.rooms[1, first : first + 1 + axes], memory.recent[:, own : own + 2 + axes], (sample - 1) % rows,
    )  # fmt: skip
    led = memory.nominal[sample % memory.nominal.shape[0], : 4 if nominal.flow.size else 0]
    table, axes_led = cells.tables[-1, begin : begin + axes], nominal.axis_gains.size > 0
    return robot_arrived(table, cells.goal, cells.tolerance, axes_led, seen, robot, led, arrival)


@compiled(borrows=True)
def remember_switch(
    k: int, cell: int, time: float, seen: FloatArray, robot: FloatArray, cells: LoopCells,
    memory: LoopMemory, begin: int,
) -> None:  # fmt: skip
    """Write the jumps of the accelerations of robot k at a switch now; arguments as in ``report``."""
    if cell + 1 < cells.rows.shape[0]:
        end = begin + robot.size // 2 - 2
        own, after = cells.tables[cell, begin:end], cells.tables[cell + 1, begin:end]
        write_jumps(own, after, time, ON_TIME, seen, robot, memory.jumps[begin:end])
        memory.jumped[k] = cell + 1
