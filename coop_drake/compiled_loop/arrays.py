"""What the compiled loop computes with: transport, departures of a run, what it remembers, and room.

Numbers of all robots are stacked. With n_k joints of robot k, and f_k joints of the robots before it, its own
axes (theta, q_k) are the rows from k + f_k on of M = N + n; its effort begins at 3 k + f_k, and its state
(z_k, z_k') at twice that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.laws.departures import WorldDepartures
from coop_drake.laws.robot_dynamics import MOTION_COLUMNS
from coop_drake.laws.team_dynamics import StickingRoom, TeamWork, sticking_room, team_work
from coop_drake.laws.words import Schedule
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import TeamArrays


class LoopCells(NamedTuple):
    """All C cells of a plan; rows from ``first[i]`` to ``first[i + 1]`` of a stack are those of cell i.

    Attributes:
        first: First entries in ``governed``, ``regions``, ``flats`` and ``fields``, shape (4, C + 1).
        rows: Governor's rows, see ``governed_gains``, shape (C, 9).
        governed: Edges of the governed sets, shape (., 4) [m].
        regions: Edges of the regions Q_i, shape (., 4) [m].
        flats: Maps, see ``VelocityField.kernel_arguments``.
        fields: What the velocity fields add to them.
        tables: The axes of all robots, shape (C, M, ``LAW_COLUMNS``).
        slices: Lower, then upper ends of the slices of (theta, q), shape (2, C, 1 + n) [rad or m].
        numbers: Inradius R [m], K with which the cell is entered [1/s^2], and longest time in it, of a team
            that passes longest time at rest [s], shape (C, 3).
        places: Of every robot the ``place`` of its ``ArrivalGoal``, one after the other, shape (3 N + n,).
        rooms: Of every robot its tolerances there, then its errors, shape (2, 2 N + n).
    """

    first: IntArray
    rows: FloatArray
    governed: FloatArray
    regions: FloatArray
    flats: FloatArray
    fields: FloatArray
    tables: FloatArray
    slices: FloatArray
    numbers: FloatArray
    places: FloatArray
    rooms: FloatArray


class LoopTeam(NamedTuple):
    """The robots, their tables stacked; row ``first[i, k]`` of a stack is the first one of robot k.

    Attributes:
        places: Where z, then its rates stand in the plant's state, shape (2, 3 + n).
        first: First rows in ``chains`` and in ``base_chains``, first joint, shape (3, N + 1).
        chains: From every robot's base to its end effector.
        base_chains: From the object to every robot's base.
        yaws: Angle of every base in the object where all joints are at zero, shape (N,) [rad].
        loads: What ``end_effector_command`` takes of every robot, shape (N, 7).
    """

    places: IntArray
    first: IntArray
    chains: FloatArray
    base_chains: FloatArray
    yaws: FloatArray
    loads: FloatArray


class LoopPlant(NamedTuple):
    """The simulated team.

    Attributes:
        tree: See ``TeamTree``.
        bases: Rows of the bases, then that of the object.
        places: Where wrenches act on them.
        shapes: Its bodies.
        walls: Edges of the floor, shape (E, 4) [m].
        reach: How far a body moves at most for a unit of theta, then of every joint, shape (1 + n,) [m or -].
        axis_rows: Row among the M axes of (theta, q), then the robot that it is taken from, shape (2, 1 + n).
        strongest: Largest effort of every joint that its model allows, shape (n,) [N m or N].
    """

    tree: FloatArray
    bases: IntArray
    places: FloatArray
    shapes: TeamArrays
    walls: FloatArray
    reach: FloatArray
    axis_rows: IntArray
    strongest: FloatArray


class LoopNominal(NamedTuple):
    """The nominal motion of a team that passes, and what its budget states; of no size where there is none.

    Attributes:
        schedule: When cells are begun and left; of no cells where the team rests in every cell.
        points: Control points of the motion, see ``motion_at``, shape (m, 3 + n), or (0, 0).
        span: Time of a span of it [s].
        gains: K_t [1/s^2] and zeta_t [1/s] of the position, then of the axes, shape (4,).
        ahead: How long after a sample its efforts act on average, T / 2 and the lag that robots know [s].
        mountings: Those of all robots, see ``place_on_axes``, shape (M,).
        levels: Of the robots' monitors, see ``largest_departure``, shape (5,) or (0,).
        unseen: t there [s].
        axis_alarms: Levels of all axes, of their rates and of where both take them, (3, M) or (3, 0).
        stated: Largest departures from the motion of the position, theta and q by the budget, then
            those of their rates, see ``allowed_departures``, shape (2, 2 + n) or (0, 0) [m, rad, and per s].
    """

    schedule: Schedule
    points: FloatArray
    span: float
    gains: FloatArray
    ahead: float
    mountings: FloatArray
    levels: FloatArray
    unseen: float
    axis_alarms: FloatArray
    stated: FloatArray


class LoopDepartures(NamedTuple):
    """What departs from the ideal team in one run.

    Attributes:
        times: Control period, longest time of the run, lag of the actuators [s], shape (3,).
        periods: Age of measurements, rows of a line of measurements, periods that a report travels, (3,).
        seeds: Of every robot and use, see ``seed_of``, shape (N, 8).
        probabilities: Of lost and of late measurements, of lost and of repeated reports, shape (4,) [-].
        errors: Standard deviation of the noise, and size, length in periods and phase of the wave of every
            component of a measured pose, then of all measured states, shape (3 + 2 (3 N + n), 4).
        biases: Constant errors of the measured pose, shape (N, 3) [m, rad].
        odometry: Factors of the measured rates of bases, shape (N,) [-].
        shifts: How much earlier robots measure than they take it for, in periods, shape (N,) [-].
        limits: Largest efforts, of every robot those of ``limit_efforts``, shape (2 N + n,) [N, N m].
        hearing: Errors of all clocks [s], how late switches are heard, and words beside the period that all
            need [periods], shape (3, N + 1), the supervisor's last.
        silences: Begin and end [s], and 0 for motors that work, 1 for held ones, 2 for limp ones; then begin
            and end of deafness [s], shape (5, N + 1).
        links: Seeds of the losses of words, of every listener and sender, shape (N + 1, N + 1).
        pauses: Begins and ends of the holds that the scenario orders [s], shape (., 2).
        world: What the world does to the team.
    """

    times: FloatArray
    periods: IntArray
    seeds: IntArray
    probabilities: FloatArray
    errors: FloatArray
    biases: FloatArray
    odometry: FloatArray
    shifts: FloatArray
    limits: FloatArray
    hearing: FloatArray
    silences: FloatArray
    links: IntArray
    pauses: FloatArray
    world: WorldDepartures


class LoopMemory(NamedTuple):
    """What changes in a run; a ring keeps its newest entry at the number of the sample modulo its length.

    Attributes:
        state: The team's, in the order of the plant, shape (2 (3 + n),).
        current: Index of the cell [-] and time of its entry [s] as the planner has them, ring (R, 2).
        poses: Measured poses, ring (D, N, 3).
        states: Measured states of all robots, ring (D, 2 (3 N + n)).
        exact: What there was to measure at the last two samples, by the parity of their numbers: poses, then
            states, shape (2, 3 N + 2 (3 N + n)).
        lines: Lines of measured poses, then of states, of every robot, shape (N, 2, rows, 1 + size).
        governors: p_G of every robot, shape (N, 2) [m].
        jumps: What fades, shape (M,).
        jumped: To which cell every robot's jumps belong, shape (N,).
        recent: Poses and own joints that robots measured at the last samples in the last cell, infinite
            before there are so many, ring (2 W, 3 N + n).
        efforts: Commands that actuators follow, shape (2, 3 N + n): what is held, and what acts [N, N m].
        channels: What the channels of reports hold, shape (N, ``channel_rows``, 2).
        reports: What robots report, and what they said last before a silence, shape (2, N, 2).
        alarms: What their monitors say, as the block ``DepartureMonitor`` shows it, and when something was
            above its level the last time; then what of it the state machine of words is told, shape (N, 5).
        words: What robots and supervisor have heard of each other and say, shape (N + 1, N + 1,
            ``WORD_SIZE``); this and the next four of a team that passes, else of shape (0, ...).
        said: What they said, ring (R, N + 1, ``WORD_SIZE``).
        motions: Of all robots, see ``phase_at``, shape (N, ``MOTION_SIZE``).
        phases: Their phases [s] and paces [-] at the last samples, and those by a clock without error, ring
            (D, N, 4).
        supervised: What the supervisor sees, see ``supervisor_step``, how often the team came to rest on its
            way, and whether it moves along it, shape (4,).
    """

    state: FloatArray
    current: FloatArray
    poses: FloatArray
    states: FloatArray
    exact: FloatArray
    lines: FloatArray
    governors: FloatArray
    jumps: FloatArray
    jumped: FloatArray
    recent: FloatArray
    efforts: FloatArray
    channels: FloatArray
    reports: FloatArray
    alarms: FloatArray
    words: FloatArray
    said: FloatArray
    motions: FloatArray
    phases: FloatArray
    supervised: FloatArray


# Room for what is computed on the way: what compiled functions allocate is counted wherever it is passed on.

TOLD, ENERGY, ACCELERATION, COMMAND = 10, 0, 1, 4
"""What a robot tells the log beside its report, and where: Delta E where no nominal motion leads [m^2/s^2],
the object's desired acceleration [m/s^2, rad/s^2], then what ``end_effector_command`` writes."""


class RobotRoom(NamedTuple):
    """Room for what one robot computes at a sample.

    Attributes:
        pose: The object's pose as the robot knows it, shape (3,).
        seen: The object's state as the robot knows it, then with the angle of the motion when efforts act,
            shape (2, 6).
        robots: The robot's own state in the same two ways, shape (2, 2 (3 + n)).
        governed: p_G' as the robot moves its own p_G, zero where the team passes, then the desired
            acceleration of the object's origin, shape (4,) [m/s, m/s^2].
        told: What every robot tells the log, see ``TOLD``, shape (N, ``TOLD``).
        law: What the law of all axes asks for, shape (M,).
        fading: The jumps of the robot's axes that fade in the cell, shape (M,).
        held: Efforts before the sample, shape (3 N + n,) [N, N m].
        errors: Of one measurement, shape (2 (3 + n),).
        line: A line of measurements, then what is measured, shape (rows + 1, 1 + size).
        arrivals: What a channel of reports holds next, of its shape.
        motion: Motion of the longest chain, see ``motion_room``.
        departing: The object's state less its velocity along the motion, shape (6,).
        then: The motion of a team that passes when what the robot knows was measured, shape (3, 3 + n).
        ahead: That when efforts act, of the same shape.
        columns: Where (x, y, theta, q) stand in it, shape (3 + n,).
        wanted: Desired accelerations of the object and of the robot's joints there, shape (3 + n,).
        led: (x, y) then and their rates, shape (4,); with the next one for the robot's monitor.
        led_axes: (theta, q_k) then and their rates, or when efforts act, shape (2, M).
    """

    pose: FloatArray
    seen: FloatArray
    robots: FloatArray
    governed: FloatArray
    told: FloatArray
    law: FloatArray
    fading: FloatArray
    held: FloatArray
    errors: FloatArray
    line: FloatArray
    arrivals: FloatArray
    motion: FloatArray
    departing: FloatArray
    then: FloatArray
    ahead: FloatArray
    columns: IntArray
    wanted: FloatArray
    led: FloatArray
    led_axes: FloatArray


def robot_room(team: LoopTeam, memory: LoopMemory) -> RobotRoom:
    """Return room for the robots of a team."""
    M, state, line = memory.jumps.size, memory.state.size, memory.lines.shape[2:]
    return RobotRoom(
        np.empty(3), np.empty((2, 6)), np.empty((2, state)), np.empty(4), np.empty((team.yaws.size, TOLD)),
        np.empty(M), np.empty(M),
        np.empty(memory.efforts.shape[1]), np.empty(state), np.empty((line[0] + 1, line[1])),
        np.empty(memory.channels.shape[1:]), _longest_motion(team), np.empty(6),
        np.empty((3, state // 2)), np.empty((3, state // 2)), np.arange(state // 2), np.empty(state // 2),
        np.empty(4), np.empty((2, M)),
    )  # fmt: skip


def _longest_motion(team: LoopTeam) -> FloatArray:
    """Return room for the motion of the longest chain of a team."""
    return np.empty((int(np.diff(team.first[:2]).max()), MOTION_COLUMNS))


class MotionRoom(NamedTuple):
    """Room for what ``advance`` computes.

    Attributes:
        acting: Efforts at the sample, shape (3 N + n,) [N, N m].
        states: State at the stage, at the sample, and what it changes by, shape (3, 2 (3 + n)).
        slopes: Accelerations, shape (3 + n,).
        wrenches: On bases and object, shape (N + 1, 3) [N, N m].
        efforts: Of the joints, at the places of their rates, shape (3 + n,) [N m or N].
        robot: State of a robot with the most joints that there can be, shape (2 (3 + n),).
        motion: Motion of the longest chain, see ``motion_room``.
        work: Of the equations of motion.
        sticking: Of blocked wheels and of the friction of joints.
        velocities: Of all bases in W, shape (N, 2) [m/s].
    """

    acting: FloatArray
    states: FloatArray
    slopes: FloatArray
    wrenches: FloatArray
    efforts: FloatArray
    robot: FloatArray
    motion: FloatArray
    work: TeamWork
    sticking: StickingRoom
    velocities: FloatArray


def plant_room(team: LoopTeam, plant: LoopPlant) -> MotionRoom:
    """Return room for a team's motion."""
    links, robots = plant.tree.shape[0], team.yaws.size
    n = links + 2
    return MotionRoom(
        np.empty(3 * robots + n - 3), np.empty((3, 2 * n)), np.empty(n), np.empty((robots + 1, 3)),
        np.zeros(n), np.empty(2 * n), _longest_motion(team), team_work(plant.tree),
        sticking_room(links, robots), np.empty((robots, 2)),
    )  # fmt: skip


class WatchRoom(NamedTuple):
    """What is remembered of a run to measure no distance in vain: P convex pieces, V vertices, K pairs.

    Attributes:
        z: The configuration of now, shape (3 + n,) [m, rad].
        last_z: The one before, NaN at the first sample.
        region: The cell, the distance of the position to its boundary when that was measured last, and the
            position then, shape (4,) [m].
        before: Forces (x, y) of all bases at the sample before, then the object's rate of rotation; NaN at
            the first one, shape (2 N + 1,) [N, rad/s].
        way: How far any point may have moved since the start, and how far two bodies may have moved
            relative to each other: the motion of the object does not count there, shape (2,) [m].
        walls: Distance of every piece to the walls when it was measured last, and the way until then; NaN
            before, shape (P, 2) [m].
        pairs: Distance of every pair that must not touch, and its way until then, shape (K, 2) [m].
        poses: Room for the poses of all components, see ``place_into``.
        vertices: Room for the vertices in W, shape (V, 2) [m].
        discs: Room for the discs in W, shape (P, 3) [m].
        nominal: Where every robot's motion is, see ``motion_at``, shape (N, 3, 3 + n).
        off: Departures from the mean of these, and of rates, and how far this mean moves in the largest error
            of a clock, shape (3, 3 + n).
    """

    z: FloatArray
    last_z: FloatArray
    region: FloatArray
    before: FloatArray
    way: FloatArray
    walls: FloatArray
    pairs: FloatArray
    poses: FloatArray
    vertices: FloatArray
    discs: FloatArray
    nominal: FloatArray
    off: FloatArray


def watch_room(plant: LoopPlant) -> WatchRoom:
    """Return what is remembered of a run that has not begun."""
    shapes, n = plant.shapes, plant.tree.shape[0] + 2
    return WatchRoom(
        np.empty(n), np.full(n, np.nan), np.full(4, np.nan), np.full(2 * plant.bases.size - 1, np.nan),
        np.zeros(2), np.full((len(shapes.pieces), 2), np.nan), np.full((len(shapes.pairs), 2), np.nan),
        *shapes.room(), np.empty((plant.bases.size - 1, 3, n)), np.empty((3, n)),
    )  # fmt: skip
