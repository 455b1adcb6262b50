"""What the controllers of all robots compute, in one call, by the functions that their blocks call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import track_axes, write_bounds, write_jumps
from coop_drake.laws.load_sharing import end_effector_command, rotated
from coop_drake.laws.robot_dynamics import read_robot, robot_effort
from coop_drake.systems.governor_kernels import govern
from coop_drake.systems.ready_kernels import robot_ready
from coop_drake.tree.pose import FloatArray, IntArray

__all__ = [
    "FusedCell",
    "FusedTeam",
    "drive_team",
    "read_own",
    "report_readiness",
    "state_of_object",
    "telemetry_parts",
    "telemetry_size",
]


class FusedCell(NamedTuple):
    """One cell for the whole team.

    Attributes:
        row: The governor's row, see ``governed_gains``, shape (9,).
        edges: Edges of the governed set, shape (edges, 4) [m].
        flat: The cell's map, as ``VelocityField.kernel_arguments`` has it.
        field: What the velocity field adds to the map.
        table: For each robot in turn the axes (theta, q_k), shape (N + n, ``LAW_COLUMNS``).
    """

    row: FloatArray
    edges: FloatArray
    flat: FloatArray
    field: FloatArray
    table: FloatArray


class FusedTeam(NamedTuple):
    """The robots, their tables stacked; row ``first[i, k]`` of a stack is the first one of robot k.

    Attributes:
        places: Where z, then its rates stand in the plant's state, shape (2, 3 + n).
        first: First rows in ``chains`` and in ``base_chains``, first joint, shape (3, N + 1).
        chains: From every robot's base to its end effector.
        base_chains: From the object to every robot's base.
        yaws: Angle of every base in the object where all joints are at zero, shape (N,) [rad].
        loads: What ``end_effector_command`` takes of every robot, shape (N, 7).
        tracking: K, zeta, K_t and zeta_t where the position tracks a nominal motion, else of shape (0,).
    """

    places: IntArray
    first: IntArray
    chains: FloatArray
    base_chains: FloatArray
    yaws: FloatArray
    loads: FloatArray
    tracking: FloatArray


def telemetry_size(robots: int, joints: int) -> int:
    """Return the size of what ``drive_team`` writes for the log."""
    return 6 + 12 * robots + 3 * joints


@compiled
def telemetry_parts(
    telemetry: FloatArray, robots: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return views of the parts of what ``drive_team`` writes for the log.

    Args:
        telemetry: All of it, shape (``telemetry_size``,).
        robots: N.

    Returns:
        The object's commanded acceleration (3,); commands of the end effectors (N, 6); poses of the bases
        (N, 3); wrenches on all bases in W, then all joint torques (3 N + n,); lower, then upper funnel
        bounds of all axes (2 (1 + n),); Delta E (1,).
    """
    joints = (telemetry.size - 6 - 12 * robots) // 3
    commands, bases, efforts = 3, 3 + 6 * robots, 3 + 9 * robots
    bounds = efforts + 3 * robots + joints
    return (
        telemetry[:commands],
        telemetry[commands:bases].reshape((robots, 6)),
        telemetry[bases:efforts].reshape((robots, 3)),
        telemetry[efforts:bounds],
        telemetry[bounds:-1],
        telemetry[-1:],
    )


@compiled
def drive_team(
    row: FloatArray, edges: FloatArray, flat: FloatArray, field: FloatArray, table: FloatArray,
    places: IntArray, first: IntArray, chains: FloatArray, base_chains: FloatArray, yaws: FloatArray,
    loads: FloatArray, time: float, clock: FloatArray, jumps: FloatArray, state: FloatArray,
    governor_position: FloatArray, command: FloatArray, telemetry: FloatArray,
) -> None:  # fmt: skip
    """Write what drives the team, and what the robots' blocks would show to the log.

    Args:
        row: This and the next four arguments are the fields of ``FusedCell``; see there.
        edges: Edges of the governed set.
        flat: The map.
        field: The velocity field.
        table: The axes of all robots.
        places: This and the next five arguments are the fields of ``FusedTeam``; see there.
        first: First rows.
        chains: From bases to end effectors.
        base_chains: From the object to bases.
        yaws: Angles of the bases.
        loads: Shares of the load.
        time: Time since the cell was entered [s].
        clock: The funnels' clock: its lag [s], its pace [-] and the derivative of the pace [1/s], shape (3,).
        jumps: Of all axes of ``table``, what ``write_jumps`` gave at the switch, shape (N + n,).
        state: State of the plant.
        governor_position: p_G, shape (2,) [m].
        command: Receives wrenches on all bases in their own axes, all joint torques and p_G', shape
            (3 N + n + 2,).
        telemetry: Receives what ``telemetry_parts`` lists.
    """
    robots, n = yaws.size, places.shape[1] - 3
    acceleration, commands, bases, efforts, bounds, margin = telemetry_parts(telemetry, robots)
    object_state, robot, governed = state_of_object(places, state), np.empty(6 + 2 * n), np.empty(4)
    margin[0] = govern(row, edges, flat, field, time, object_state, governor_position, governed)
    acceleration[0], acceleration[1] = governed[2], governed[3]
    axes, effort, own_bounds = np.empty(1 + n), np.empty(3 + n), np.empty(2 + 2 * n)
    for k in range(robots):
        start, stop = first[2, k], first[2, k + 1]
        m = 1 + stop - start
        rows, chain = table[start + k : stop + k + 1], chains[first[0, k] : first[0, k + 1]]
        read_own(k, places, first, base_chains, yaws, state, robot)
        track_axes(rows, time, clock, jumps[start + k : stop + k + 1], object_state, robot, axes)
        end_effector_command(loads[k], object_state, governed[2:], axes, commands[k])
        robot_effort(chain, robot, commands[k], axes, effort)
        write_bounds(rows, time - clock[0], own_bounds)
        acceleration[2], bounds[0], bounds[1 + n] = axes[0], own_bounds[0], own_bounds[m]
        for i in range(3):
            bases[k, i], efforts[3 * k + i] = robot[i], effort[i]
        for i in range(stop - start):
            efforts[3 * robots + start + i] = effort[3 + i]
            bounds[1 + start + i], bounds[2 + n + start + i] = own_bounds[1 + i], own_bounds[m + 1 + i]
    command[: efforts.size], command[efforts.size :] = efforts, clock[1] * governed[:2]
    for k in range(robots):
        c, s, at = np.cos(bases[k, 2]), np.sin(bases[k, 2]), 3 * k
        command[at], command[at + 1] = rotated(c, -s, efforts[at], efforts[at + 1])


@compiled
def report_readiness(
    table: FloatArray, next_table: FloatArray, next_edges: FloatArray, next_stiffness: float,
    inradius: float, goal: FloatArray, tolerance: float, last: bool, places: IntArray, first: IntArray,
    base_chains: FloatArray, yaws: FloatArray, index: int, time: float, state: FloatArray,
    governor_position: FloatArray, reports: FloatArray,
) -> None:  # fmt: skip
    """Write for each robot the index of the current cell and the margin of ``robot_ready``, shape (2 N,).

    Args:
        table: This and the next seven arguments are the conditions ``ReadyConditions``; see there. The tables
            are those of ``FusedCell``.
        next_table: The axes in the next cell.
        next_edges: Edges of the next cell.
        next_stiffness: K with which it is entered.
        inradius: R of the transition.
        goal: Goal position.
        tolerance: Tolerance of the goal position.
        last: Whether this is the last cell.
        places: Where z and its rates stand in the plant's state.
        first: First rows of a ``FusedTeam``.
        base_chains: From the object to bases.
        yaws: Angles of the bases.
        index: Index of the current cell.
        time: Time since it was entered [s].
        state: State of the plant.
        governor_position: p_G, shape (2,) [m].
        reports: Receives the reports.
    """
    object_state, robot = state_of_object(places, state), np.empty(2 * places.shape[1])
    for k in range(yaws.size):
        start, stop = first[2, k] + k, first[2, k + 1] + k + 1
        read_own(k, places, first, base_chains, yaws, state, robot)
        reports[2 * k] = index
        reports[2 * k + 1] = robot_ready(
            table[start:stop], next_table[start:stop], next_edges, next_stiffness, inradius, goal, tolerance,
            last, time, object_state, robot, governor_position,
        )  # fmt: skip


@compiled
def remember_jumps(
    table: FloatArray, next_table: FloatArray, places: IntArray, first: IntArray, base_chains: FloatArray,
    yaws: FloatArray, time: float, clock: FloatArray, state: FloatArray, reports: FloatArray,
    jumps: FloatArray,
) -> None:  # fmt: skip
    """Write ``write_jumps`` of every robot that is ready.

    Args:
        table: The axes of all robots in the current cell.
        next_table: The axes in the next cell.
        places: Where z and its rates stand in the plant's state.
        first: First rows of a ``FusedTeam``.
        base_chains: From the object to bases.
        yaws: Angles of the bases.
        time: Time since the current cell was entered [s].
        clock: The funnels' clock, as in ``drive_team``.
        state: State of the plant.
        reports: What ``report_readiness`` gives.
        jumps: Receives the jumps of the robots that are ready, shape (N + n,).
    """
    object_state, robot = state_of_object(places, state), np.empty(2 * places.shape[1])
    for k in range(yaws.size):
        if reports[2 * k + 1] >= 0.0:
            start, stop = first[2, k] + k, first[2, k + 1] + k + 1
            read_own(k, places, first, base_chains, yaws, state, robot)
            write_jumps(
                table[start:stop], next_table[start:stop], time, clock, object_state, robot, jumps[start:stop]
            )


@compiled
def read_own(
    k: int,
    places: IntArray,
    first: IntArray,
    base_chains: FloatArray,
    yaws: FloatArray,
    state: FloatArray,
    robot: FloatArray,
) -> None:
    """Write (z_k, z_k') of robot k, see ``read_robot``."""
    joints = places[:, 3 + first[2, k] : 3 + first[2, k + 1]]
    read_robot(base_chains[first[1, k] : first[1, k + 1]], yaws[k], joints, state, robot)


@compiled
def state_of_object(places: IntArray, state: FloatArray) -> FloatArray:
    """Return pose and twist of the object, shape (6,)."""
    object_state = np.empty(6)
    for i in range(3):
        object_state[i], object_state[3 + i] = state[places[0, i]], state[places[1, i]]
    return object_state
