"""What the robots of the compiled loop measure and compute, by the laws that Drake's blocks call.

Functions of large named tuples that are called in one place are ``inlined``: each array in them is seven
numbers to hand over.
"""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.compiled_loop.arrays import (
    ACCELERATION,
    COMMAND,
    ENERGY,
    LoopCells,
    LoopDepartures,
    LoopMemory,
    LoopNominal,
    LoopTeam,
    RobotRoom,
)
from coop_drake.jit import compiled
from coop_drake.laws import words
from coop_drake.laws.axis_table import track_axes, write_jumps
from coop_drake.laws.measurements import NOTHING, carry_measurements, uniform_pair, write_errors
from coop_drake.laws.motion import motion_at, place_on_axes, pull
from coop_drake.laws.readiness import (
    BRAKES,
    FAR,
    QUIET,
    alarm_at,
    arrival_margin,
    clearance_margin,
    largest_departure,
)
from coop_drake.laws.robot_dynamics import end_effector_command, estimate_object, read_robot, robot_effort
from coop_drake.systems.kernels import (
    axes_ready,
    cell_margin,
    govern,
)
from coop_drake.tree.arrays import FloatArray, IntArray

LOST_POSE, POSE_NOISE = 1, 5
"""Uses of seeds: losses and noise of measured poses; those of measured states are the next ones."""

ON_TIME = np.array([0.0, 1.0, 0.0])
"""A clock that never stood still: lag [s], pace [-] and the derivative of the pace [1/s]."""

EARLY = 1e-6
"""Share of a period by which an interval that begins at a sample may seem to begin later [-], by rounding."""

ALARM, SAID = 0, 4
"""Where the alarm stands of a robot's monitor, and what of it the state machine of words is told."""


@compiled(inlined=True, borrows=True)
def talk(
    sample: int, now: float, nominal: LoopNominal, departures: LoopDepartures, memory: LoopMemory
) -> None:  # fmt: skip
    """Let robots and supervisor of a team that passes hear what was said, and decide.

    Args:
        sample: Number of the sample.
        now: Time of the run [s].
        nominal: The motion.
        departures: What departs.
        memory: Receives what everybody has heard, and what robots do.
    """
    robots, schedule, loss = memory.motions.shape[0], nominal.schedule, departures.probabilities[2]
    early, cell = now + EARLY * departures.times[0], schedule.begins.size - 1
    moves, phase = False, np.inf
    for node in range(robots + 1):
        known, age = memory.words[node], 1 + int(departures.hearing[2, node])
        deaf = departures.silences[3, node] <= early < departures.silences[4, node]
        said = memory.said[(sample - age) % memory.said.shape[0]]
        for sender in range(robots + 1):
            if sender == node or sample < age or deaf:
                continue
            if loss > 0.0 and uniform_pair(departures.links[node, sender], sample)[0] < loss:
                continue
            words.hear(known, sender, said[sender])
        if node == robots:
            wanted = True
            for i in range(departures.pauses.shape[0]):
                wanted = wanted and not departures.pauses[i, 0] <= now < departures.pauses[i, 1]
            seen = words.supervisor_step(schedule, now, wanted, known)
            memory.supervised[0], memory.supervised[1] = seen[0], seen[1]
            continue
        clock, alarm = now + departures.hearing[0, node], int(memory.alarms[node, SAID])
        phases = memory.phases[sample % memory.phases.shape[0], node]
        motion = memory.motions[node]
        phases[0], phases[1], _ = words.robot_step(schedule, clock, alarm, node, motion, known)
        phases[2], phases[3], _ = words.phase_at(schedule, motion, now)  # Stamps are of one time.
        moves, phase = moves or phases[1] > 0.0, min(phase, phases[0])
        cell = min(cell, begun(schedule.begins, phases[0]))
    if not moves and memory.supervised[3] > 0.0 and phase < schedule.ends[-1]:
        memory.supervised[2] += 1.0
    memory.supervised[3] = 1.0 if moves else 0.0
    ring = memory.current.shape[0]
    entered, following = memory.current[sample % ring], memory.current[(sample + 1) % ring]
    following[0], following[1] = entered[0], entered[1]
    if cell != entered[0]:
        following[0], following[1] = cell, now


@compiled(borrows=True)
def begun(begins: FloatArray, phase: float) -> int:
    """Return the last cell that is begun at a phase [s] or before."""
    return max(int(np.searchsorted(begins, phase, side="right")) - 1, 0)


@compiled(inlined=True, borrows=True)
def compute(
    sample: int, number: int, now: float, whole: bool, cells: LoopCells, team: LoopTeam,
    nominal: LoopNominal, departures: LoopDepartures, room: RobotRoom, memory: LoopMemory,
) -> None:  # fmt: skip
    """Do what all robots do at a sample: measure, compute efforts, move their own p_G, and report.

    Args:
        sample: Number of the sample, or of the next one between two samples.
        number: Number of the control period whose noise and losses there are now.
        now: Time of the run [s].
        whole: Whether the whole margin of every report is wanted, as blocks would report it; of a negative
            one that rests on axes alone only the sign counts, and the position is not judged in vain.
        cells: The plan's cells.
        team: The robots' models.
        nominal: The nominal motions.
        departures: What departs.
        room: Receives the accelerations of the law of all axes, and what robots tell the log.
        memory: What changes.
    """
    first, period, lossy = team.first, departures.times[0], departures.probabilities
    taken, seen_at = sample % memory.poses.shape[0], max(sample - departures.periods[0], 0)
    passes, points, span = nominal.points.size > 0, nominal.points, nominal.span
    last_cell = cells.rows.shape[0] - 1
    decided = sample - 1 if whole else sample  # The last sample at which a team that passes has decided.
    for k in range(team.yaws.size):
        # Its axes are the rows from ``begin`` to ``end``, its z_k stands at ``own``.
        begin, end, own = k + first[2, k], k + 1 + first[2, k + 1], 3 * k + first[2, k]
        size, chain = 2 * (2 + end - begin), team.chains[first[0, k] : first[0, k + 1]]
        told, load = room.told[k], team.loads[k]

        # Measurements, with constant errors and noise; then what of them arrives.
        pose, robot = memory.poses[taken, k], memory.states[taken, 2 * own : 2 * own + size]
        for i in range(3):
            pose[i] = memory.state[team.places[0, i]] + departures.biases[k, i]
        joints = team.places[:, 3 + first[2, k] : 3 + first[2, k + 1]]
        base = team.base_chains[first[1, k] : first[1, k + 1]]
        read_robot(base, team.yaws[k], joints, room.motion, memory.state, robot)
        for i in range(size // 2, size // 2 + 3):
            robot[i] *= departures.odometry[k]
        seed, shift, sizes = departures.seeds[k, POSE_NOISE], departures.shifts[k], departures.errors
        of_pose = 0.0 if passes else shift  # The pose has stamps of one time where the team passes.
        _err(sample, 3 * k, of_pose, memory.exact, seed, number, sizes[:3], room.errors, pose)
        seed, sizes = departures.seeds[k, POSE_NOISE + 1], sizes[3 + 2 * own : 3 + 2 * own + size]
        of_states = 3 * team.yaws.size + 2 * own
        _err(sample, of_states, shift, memory.exact, seed, number, sizes, room.errors, robot)
        pose, robot, seen = room.pose, room.robots[0, :size], room.seen[0]
        for i in range(3):
            pose[i] = memory.poses[seen_at % memory.poses.shape[0], k, i]
        for i in range(size):
            robot[i] = memory.states[seen_at % memory.poses.shape[0], 2 * own + i]
        if lossy[0] > 0.0 or lossy[1] > 0.0:
            seed = departures.seeds[k, LOST_POSE]
            _pass(sample, number, seed, lossy, room.line, memory.lines[k, 0], pose)
            seed = departures.seeds[k, LOST_POSE + 1]
            _pass(sample, number, seed, lossy, room.line, memory.lines[k, 1], robot)
        estimate_object(chain, load[:2], room.motion, robot, pose, seen)

        # Where the motion of a team that passes was when this was measured, and will be when efforts act.
        cell, time = heard_cell(k, sample, now, departures.hearing, memory.current)
        if passes:
            schedule, motion, clock = nominal.schedule, memory.motions[k], now + departures.hearing[0, k]
            cell = begun(schedule.begins, memory.phases[decided % memory.phases.shape[0], k, 0])
            stamp = memory.phases[(decided - int(departures.periods[0])) % memory.phases.shape[0], k]
            motion_at(points, span, stamp[2], stamp[3], 0.0, room.then)
            phase, pace, rate = words.phase_at(schedule, motion, clock + nominal.ahead)
            motion_at(points, span, phase, pace, rate, room.ahead)
            phase, _, _ = words.phase_at(schedule, motion, clock)
        if nominal.levels.size:  # What the monitor says, by raw measurements and their time stamp.
            led, axes, alarms = room.led, room.led_axes[:, begin:end], memory.alarms[k]
            for i in range(4):
                led[i] = room.then[i // 2, i % 2]
            _take_axes(room.then, room.columns[3 + first[2, k] : 3 + first[2, k + 1]], axes)
            share, which = largest_departure(
                load, nominal.mountings[begin:end], room.motion[len(chain) - 1], robot, seen, led, axes,
                nominal.levels, nominal.axis_alarms[:, begin:end], nominal.unseen,
            )  # fmt: skip
            alarms[ALARM], alarms[1], alarms[2] = alarm_at(share, now, alarms[3]), share, which
            if share > 1.0:
                alarms[3] = now

        # The desired accelerations of the object's origin and of the axes, and p_G': by the motion of a team
        # that passes, else by the governor and by the law of the axes.
        edges, acts = cells.governed[cells.first[0, cell] : cells.first[0, cell + 1]], 0
        governed, governor = room.governed, memory.governors[k]
        table, law, jumps = cells.tables[cell, begin:end], room.law[begin:end], room.fading[begin:end]
        if passes:
            acts, columns = 1, room.columns[3 + first[2, k] : 3 + first[2, k + 1]]
            wanted, governed[0], governed[1] = room.wanted[: size // 2], 0.0, 0.0
            linear, asked, axes = wanted[:2], wanted[2:], room.led_axes[:, begin:end]
            pull(room.ahead, room.then, columns, nominal.gains, seen, robot, wanted)
            for i in range(6):
                room.seen[1, i] = seen[i]
            for i in range(size):
                room.robots[1, i] = robot[i]
            _take_axes(room.ahead, columns, axes)
            room.seen[1, 2], room.seen[1, 5] = axes[0, 0], axes[1, 0]
            place_on_axes(axes, nominal.mountings[begin:end], room.robots[1, :size])
            if whole:  # Delta E of the departure from the motion.
                for i in range(6):
                    room.departing[i] = seen[i] - (room.then[1, i - 3] if i in (3, 4) else 0.0)
                told[ENERGY], _ = cell_margin(edges, nominal.gains[0], room.departing, room.then[0])
        else:
            linear, asked = governed[2:], law
            flat = cells.flats[cells.first[2, cell] : cells.first[2, cell + 1]]
            field = cells.fields[cells.first[3, cell] : cells.first[3, cell + 1]]
            told[ENERGY] = govern(cells.rows[cell], edges, flat, field, time, seen, governor, governed)
            for i in range(begin, end):
                room.fading[i] = memory.jumps[i] if memory.jumped[k] == cell else 0.0
            track_axes(table, time, ON_TIME, jumps, seen, robot, law)

        # What the end effector does, and the effort for all of it.
        told[ACCELERATION], told[ACCELERATION + 1], told[ACCELERATION + 2] = linear[0], linear[1], asked[0]
        end_effector_command(load, room.seen[acts], linear, asked, told[COMMAND:])
        effort = memory.efforts[0, own : own + size // 2]
        robot_effort(chain, room.motion, room.robots[acts, :size], told[COMMAND:], asked, effort)

        # The report.
        margin = FAR
        if cell == last_cell:
            rows, places = memory.recent.shape[0], cells.places[own : own + size // 2]
            tolerances, errors = cells.rooms[:, k + begin : k + end + 1]
            recent = memory.recent[:, own : own + size // 2]
            margin = arrival_margin(places, tolerances, errors, recent, (sample - 1) % rows)
            if passes and phase < schedule.ends[-1]:
                margin = min(margin, phase - schedule.ends[-1])
            for i in range(size // 2):
                recent[sample % rows, i] = pose[i] if i < 3 else robot[i]
        elif passes:
            margin = phase - schedule.begins[cell + 1]
        else:
            margin = axes_ready(table, cells.tables[cell + 1, begin:end], False, time, seen, robot)
            if whole or not margin < 0.0:
                stiffness = cells.numbers[cell + 1, 1]
                following = cells.governed[cells.first[0, cell + 1] : cells.first[0, cell + 2]]
                energy, _ = cell_margin(following, stiffness, seen, governor)
                margin = min(clearance_margin(energy, stiffness, cells.numbers[cell, 0]), margin)
        alarm, said = memory.alarms[k, ALARM], words.QUIET
        if alarm != QUIET:
            margin, said = min(margin, FAR), words.BRAKES if alarm == BRAKES else words.ASKS
        elif passes and cell == last_cell and margin >= 0.0:
            said = words.THERE
        memory.alarms[k, SAID] = said
        memory.reports[0, k, 0], memory.reports[0, k, 1] = cell, margin
        if margin >= 0.0 and cell < last_cell and not passes:  # The next cell may begin now.
            after, own_jumps = cells.tables[cell + 1, begin:end], memory.jumps[begin:end]
            write_jumps(table, after, time, ON_TIME, seen, robot, own_jumps)
            memory.jumped[k] = cell + 1
        memory.governors[k, 0] += period * governed[0]
        memory.governors[k, 1] += period * governed[1]


@compiled(borrows=True)
def _take_axes(motion: FloatArray, columns: IntArray, axes: FloatArray) -> None:
    """Take the axes (theta, q_k) of a robot and their rates out of what ``motion_at`` writes."""
    for row in range(2):
        axes[row, 0] = motion[row, 2]
        for i in range(columns.size):
            axes[row, 1 + i] = motion[row, columns[i]]


@compiled(borrows=True)
def _err(
    sample: int, first: int, shift: float, exact: FloatArray, seed: int, number: int, sizes: FloatArray,
    errors: FloatArray, values: FloatArray,
) -> None:  # fmt: skip
    """Replace what there is to measure by what is measured: at another time by a wrong clock, with errors.

    Between two samples, and as much beyond, motions are taken for uniform, see ``ShiftedMeasurement``.

    Args:
        sample: Number of the sample.
        first: Where the values stand in a row of ``exact``.
        shift: How much earlier they are measured, in periods.
        exact: See ``LoopMemory``.
        seed: That of the noise.
        number: Number of the control period whose noise there is now.
        sizes: Of the errors, see ``LoopDepartures``, shape (size, 4).
        errors: Room for them.
        values: What there is; receives what is measured, shape (size,).
    """
    if shift != 0.0:
        there, before = exact[sample % 2], exact[(sample + 1) % 2]
        for i in range(values.size):
            there[first + i] = values[i]
            if sample == 0:
                before[first + i] = values[i]
        for i in range(values.size):
            change = values[i] - before[first + i]
            if i == 2 and values.size > 3:  # A yaw is known modulo a turn.
                change -= 2.0 * pi * round(change / (2.0 * pi))
            values[i] -= shift * change
    largest = 0.0
    for i in range(values.size):
        largest = max(largest, sizes[i, 0], sizes[i, 1])
    if largest > 0.0:
        write_errors(seed, sizes[:, 0], sizes[:, 1:], number, errors[: values.size])
        for i in range(values.size):
            values[i] += errors[i]


@compiled(borrows=True)
def _pass(
    sample: int, number: int, seed: int, probabilities: FloatArray, room: FloatArray, line: FloatArray,
    values: FloatArray,
) -> None:  # fmt: skip
    """Replace what is measured by what has arrived of it, and carry the line over a period.

    Args:
        sample: Number of the sample.
        number: Number of the control period.
        seed: That of the losses.
        probabilities: See ``LoopDepartures``.
        room: Room for a line and what is measured, shape (rows + 1, 1 + size).
        line: The line, shape (rows, 1 + size).
        values: What is measured; receives what has arrived.
    """
    rows = line.shape[0]
    if sample == 0:  # What is measured first is there from the beginning.
        for row in range(rows):
            line[row, 0] = NOTHING
            for i in range(values.size):
                line[row, 1 + i] = values[i]
    measured, following = room[rows, 1:], room[:rows]
    for i in range(measured.size):
        measured[i] = values[i] if i < values.size else 0.0
    chances = uniform_pair(seed, number)
    lost, late = chances[0] < probabilities[0], chances[1] < probabilities[1]
    if lost or late:
        for i in range(values.size):
            values[i] = line[0, 1 + i]
    carry_measurements(line, number, measured, lost, late, following)
    for row in range(rows):
        for i in range(line.shape[1]):
            line[row, i] = following[row, i]


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
