"""What one robot of the compiled loop measures and computes, by the laws that Drake's blocks call.

Functions of large named tuples that are called in one place are ``inlined``: each array in them is seven
numbers to hand over.
"""

from __future__ import annotations

import numpy as np

from coop_drake.compiled_loop.arrays import (
    ACCELERATION,
    COMMAND,
    ENERGY,
    LoopCells,
    LoopDepartures,
    LoopMemory,
    LoopNominal,
    RobotRoom,
)
from coop_drake.jit import compiled
from coop_drake.laws.arrival import arrival_margin
from coop_drake.laws.axis_table import bounds_of, track_axes, write_jumps
from coop_drake.laws.channels import NOTHING, carry_measurements
from coop_drake.laws.departure import alarm_at, axis_level, largest_departure, quiet_margin
from coop_drake.laws.load_sharing import end_effector_command
from coop_drake.laws.measurement_errors import shift_back, write_errors
from coop_drake.laws.nominal_axes import carry_axes, place_on_axes, pull_axes
from coop_drake.laws.random_draws import uniform_pair
from coop_drake.laws.robot_dynamics import estimate_object, robot_effort
from coop_drake.systems.governor_kernels import govern
from coop_drake.systems.nominal_kernels import accelerate_along, show_nominal
from coop_drake.systems.ready_kernels import axes_ready, robot_arrived, robot_ready, robot_ready_along
from coop_drake.systems.team_kernels import FusedTeam, read_own
from coop_drake.tree.pose import FloatArray

LOST_POSE, POSE_NOISE = 1, 5
"""Uses of seeds: losses and noise of measured poses; those of measured states are the next ones."""

ON_TIME = np.array([0.0, 1.0, 0.0])
"""A clock that never stood still: lag [s], pace [-] and the derivative of the pace [1/s]."""


@compiled(inlined=True, borrows=True)
def measure(
    sample: int, number: int, team: FusedTeam, departures: LoopDepartures, memory: LoopMemory,
    room: RobotRoom,
) -> None:  # fmt: skip
    """Write what every robot's sensors measure at a sample, before delay and losses.

    Args:
        sample: Number of the sample, or of the next one between two samples.
        number: Number of the control period whose noise there is now.
        team: The robots' models.
        departures: What departs.
        memory: What changes.
        room: Room for the motion of a robot and for the errors of its state.
    """
    now, robots = sample % memory.poses.shape[0], team.yaws.size
    for k in range(robots):
        own = 3 * k + team.first[2, k]
        size = 3 + team.first[2, k + 1] - team.first[2, k]
        pose, robot = memory.poses[now, k], memory.states[now, 2 * own : 2 * (own + size)]
        for i in range(3):
            pose[i] = memory.state[team.places[0, i]] + departures.biases[k, i]
        read_own(k, team.places, team.first, team.base_chains, team.yaws, room.motion, memory.state, robot)
        for i in range(size, size + 3):
            robot[i] *= departures.odometry[k]
        for kind in range(2):
            values, first, first_size = pose, 3 * k, 0
            if kind == 1:
                values, first, first_size = robot, 3 * robots + 2 * own, 3 + 2 * own
            if departures.shifts[k] != 0.0:
                there = memory.exact[sample % 2, first : first + values.size]
                before = memory.exact[(sample + 1) % 2, first : first + values.size]
                for i in range(values.size):
                    there[i] = values[i]
                    if sample == 0:
                        before[i] = values[i]
                shift_back(values, before, departures.shifts[k])
            sizes, errs = departures.errors[first_size : first_size + values.size], False
            for i in range(values.size):
                errs = errs or sizes[i, 0] > 0.0 or sizes[i, 1] > 0.0
            if errs:
                errors = room.errors[: values.size]
                write_errors(
                    departures.seeds[k, POSE_NOISE + kind], sizes[:, 0], sizes[:, 1:], number, errors
                )
                for i in range(values.size):
                    values[i] += errors[i]


@compiled(inlined=True, borrows=True)
def receive(
    k: int, sample: int, number: int, team: FusedTeam, departures: LoopDepartures, memory: LoopMemory,
    pose: FloatArray, robot: FloatArray, following: FloatArray,
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
        following: Room for a line and what is measured, shape (rows + 1, 1 + size).
    """
    own = 2 * (3 * k + team.first[2, k])
    seen = max(sample - departures.periods[0], 0) % memory.poses.shape[0]
    for i in range(3):
        pose[i] = memory.poses[seen, k, i]
    for i in range(robot.size):
        robot[i] = memory.states[seen, own + i]
    if not (departures.probabilities[0] > 0.0 or departures.probabilities[1] > 0.0):
        return
    for kind in range(2):
        values, line = pose if kind == 0 else robot, memory.lines[k, kind]
        if sample == 0:  # What is measured first is there from the beginning.
            for row in range(line.shape[0]):
                line[row, 0] = NOTHING
                for i in range(values.size):
                    line[row, 1 + i] = values[i]
        measured, carried = following[line.shape[0], 1:], following[: line.shape[0]]
        for i in range(measured.size):
            measured[i] = values[i] if i < values.size else 0.0
        chances = uniform_pair(departures.seeds[k, LOST_POSE + kind], number)
        lost, late = chances[0] < departures.probabilities[0], chances[1] < departures.probabilities[1]
        if lost or late:
            for i in range(values.size):
                values[i] = line[0, 1 + i]
        carry_measurements(line, number, measured, lost, late, carried)
        for row in range(line.shape[0]):
            for i in range(line.shape[1]):
                line[row, i] = carried[row, i]


@compiled(borrows=True)
def heard_cell(
    k: int, sample: int, now: float, hearing: FloatArray, current: FloatArray
) -> tuple[int, float]:
    """Return the cell that robot k knows, and the time since its entry by its own clock [s].

    Args:
        k: The robot.
        sample: Number of the sample, or of the next one between two samples.
        now: Time of the run [s].
        hearing: See ``LoopDepartures``.
        current: See ``LoopMemory``.
    """
    heard = sample - int(hearing[1, k])
    if heard < 0:  # it has heard nothing yet, and begins in the first cell
        return 0, now
    entered = current[heard % current.shape[0]]
    return int(entered[0]), now - (entered[1] - hearing[0, k])


@compiled(inlined=True, borrows=True)
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
    begin, end = k + team.first[2, k], k + 1 + team.first[2, k + 1]
    measured, seen, governed = room.robots[0, : 2 * (2 + end - begin)], room.seen[0], room.governed
    receive(k, sample, number, team, departures, memory, room.pose, measured, room.line)
    chain = team.chains[team.first[0, k] : team.first[0, k + 1]]
    estimate_object(chain, team.loads[k, :2], room.motion, measured, room.pose, seen)
    cell, time = heard_cell(k, sample, now, departures.hearing, memory.current)
    if nominal.flow.size:
        governed[0], governed[1] = 0.0, 0.0
        ring = memory.nominal.shape[0]
        here, then = memory.nominal[sample % ring], max(sample - departures.periods[0], 0) % ring
        accelerate_along(team.tracking, seen, here[4:6], here, memory.nominal[then], governed[2:])
    else:
        first = cells.first
        edges = cells.governed[first[0, cell] : first[0, cell + 1]]
        flat = cells.flats[first[2, cell] : first[2, cell + 1]]
        field = cells.fields[first[3, cell] : first[3, cell + 1]]
        row = cells.rows[cell]
        room.told[ENERGY] = govern(row, edges, flat, field, time, seen, memory.governors[k], governed)
    led_row = follow_axes(k, sample, cell, time, cells, team, nominal, departures, memory, room)
    led, led_robot = room.seen[led_row], room.robots[led_row, : measured.size]
    margin = report(
        k, sample, cell, time, led, led_robot, cells, nominal, departures, memory, begin, whole, room.shown
    )
    if cell + 1 == cells.rows.shape[0]:
        own = 2 * k + begin
        newest = memory.recent[sample % memory.recent.shape[0], own : own + 2 + end - begin]
        for i in range(newest.size):
            newest[i] = room.pose[i] if i < 3 else measured[i]
    if nominal.levels.size:
        judge(k, sample, now, team, cells, nominal, departures, memory, room, measured)
        margin = quiet_margin(margin, memory.alarms[k, 0])
    memory.reports[0, k, 0], memory.reports[0, k, 1] = cell, margin
    if margin >= 0.0 and cell + 1 < cells.rows.shape[0]:  # The next cell may begin now.
        own_rows, after = cells.tables[cell, begin:end], cells.tables[cell + 1, begin:end]
        write_jumps(own_rows, after, time, ON_TIME, led, led_robot, memory.jumps[begin:end])
        memory.jumped[k] = cell + 1
    memory.governors[k, 0] += departures.times[0] * governed[0]
    memory.governors[k, 1] += departures.times[0] * governed[1]


@compiled(inlined=True, borrows=True)
def follow_axes(
    k: int, sample: int, cell: int, time: float, cells: LoopCells, team: FusedTeam, nominal: LoopNominal,
    departures: LoopDepartures, memory: LoopMemory, room: RobotRoom,
) -> int:  # fmt: skip
    """Write the effort of robot k and what the law of its axes asks for.

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
        room: Holds the states of object and robot as the robot knows them, and the desired acceleration of
            the object's origin; receives the accelerations of the law, and what the robot tells the log.

    Returns:
        The row of ``room.seen`` and of ``room.robots`` with the states on which the law acts, and by which
        the robot is ready.
    """
    begin, end = k + team.first[2, k], k + 1 + team.first[2, k + 1]
    size, fades, axes_led = 2 * (2 + end - begin), memory.jumped[k] == cell, nominal.axis_gains.size > 0
    ring, mounting = memory.axes.shape[0], nominal.mountings[begin:end]
    gains, lag, now = nominal.axis_gains, 0.0, memory.axes[sample % ring, :, begin:end]
    linear, law, pulled, jumps = room.governed[2:], room.law[begin:end], room.law[begin:end], room.fading
    led, wanted, own = 1 if axes_led else 0, room.told[COMMAND:], 3 * k + team.first[2, k]
    for i in range(begin, end):
        jumps[i] = memory.jumps[i] if fades else 0.0
    if axes_led:
        lag = gains[2]
        _place(now, mounting, room.seen[0], room.robots[0, :size], room.seen[1], room.robots[1, :size])
    track_axes(
        cells.tables[cell, begin:end], time, ON_TIME, jumps[begin:end], room.seen[led],
        room.robots[led, :size], law,
    )  # fmt: skip
    if axes_led:
        then = memory.axes[max(sample - departures.periods[0], 0) % ring, :2, begin:end]
        later, pulled = room.later[:, begin:end], room.pulled[begin:end]
        pull_axes(law, room.seen[0], room.robots[0, :size], then, (gains[0], gains[1]), pulled)
        carry_axes(now, law, 0.5 * departures.times[0] + lag, lag, later)
        _place(later, mounting, room.seen[0], room.robots[0, :size], room.seen[2], room.robots[2, :size])
    # Accelerations become efforts with the states of when these act.
    acts = 2 if axes_led else 0
    room.told[ACCELERATION], room.told[ACCELERATION + 1] = linear[0], linear[1]
    room.told[ACCELERATION + 2] = pulled[0]
    end_effector_command(team.loads[k], room.seen[acts], linear, pulled, wanted)
    chain = team.chains[team.first[0, k] : team.first[0, k + 1]]
    effort = memory.efforts[0, own : own + 2 + end - begin]
    robot_effort(chain, room.motion, room.robots[acts, :size], wanted, pulled, effort)
    return led


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


@compiled(inlined=True, borrows=True)
def report(
    k: int, sample: int, cell: int, time: float, seen: FloatArray, robot: FloatArray, cells: LoopCells,
    nominal: LoopNominal, departures: LoopDepartures, memory: LoopMemory, begin: int, whole: bool,
    shown: FloatArray,
) -> float:  # fmt: skip
    """Return the margin with which robot k is ready; of a negative one only its sign unless ``whole``.

    Args:
        k: This and the next three arguments are those of ``follow_axes``.
        sample: Number of the sample.
        cell: The cell.
        time: Time since its entry [s].
        seen: The object's state by which it judges, shape (6,).
        robot: Its own, shape (2 (3 + n_k),).
        cells: This and the next three arguments are those of ``follow_axes``.
        nominal: The nominal motions.
        departures: What departs.
        memory: What changes.
        begin: Its first row among all axes.
        whole: Whether the margin is wanted that its blocks would report.
        shown: Room for what ``show_nominal`` writes.
    """
    end, following = begin + robot.size // 2 - 2, cell + 1
    if following == cells.rows.shape[0]:
        axes, rows, own, first = robot.size // 2 - 2, memory.recent.shape[0], 2 * k + begin, k + begin
        arrival = arrival_margin(
            cells.places[own : own + 2 + axes], cells.rooms[0, first : first + 1 + axes],
            cells.rooms[1, first : first + 1 + axes], memory.recent[:, own : own + 2 + axes],
            (sample - 1) % rows,
        )  # fmt: skip
        led = memory.nominal[sample % memory.nominal.shape[0], : 4 if nominal.flow.size else 0]
        table, axes_led = cells.tables[-1, begin : begin + axes], nominal.axis_gains.size > 0
        return robot_arrived(table, cells.goal, cells.tolerance, axes_led, seen, robot, led, arrival)
    own_rows, after = cells.tables[cell, begin:end], cells.tables[following, begin:end]
    margin = axes_ready(own_rows, after, False, time, seen, robot)
    if margin < 0.0 and not whole:  # the position is not judged in vain
        return margin
    edges = cells.governed[cells.first[0, following] : cells.first[0, following + 1]]
    stiffness, inradius = cells.numbers[following, 1], cells.numbers[cell, 0]
    if not nominal.flow.size:
        return robot_ready(
            own_rows, after, edges, stiffness, inradius, cells.goal, cells.tolerance, False, time, seen,
            robot, memory.governors[k],
        )  # fmt: skip
    state = memory.nominal[sample % memory.nominal.shape[0]]
    here = cells.governed[cells.first[0, cell] : cells.first[0, cell + 1]]
    speed, periods = nominal.position[0], nominal.position[1]
    period, target = departures.times[0], cells.numbers[cell, 3:]
    show_nominal(here, cells.numbers[cell, 1], target, period, periods, speed, state, shown)
    return robot_ready_along(
        own_rows, after, edges, stiffness, inradius, cells.goal, cells.tolerance, False, time, seen, robot,
        state[4:6], shown,
    )  # fmt: skip


@compiled(inlined=True, borrows=True)
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
    then = made * departures.times[0] if age else now
    cell, time = heard_cell(k, made, then, departures.hearing, memory.current)
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
        chain, team.loads[k], mounting, room.motion, robot, room.seen[0], led, axes, nominal.levels, levels,
        nominal.unseen,
    )  # fmt: skip
    alarms[0], alarms[1], alarms[2] = alarm_at(share, now, alarms[3]), share, which
    if share > 1.0:
        alarms[3] = now
