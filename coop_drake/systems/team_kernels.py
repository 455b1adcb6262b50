"""What all robots of a team compute, in one call: the fused mode's law and its ready reports."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.compiled import compiled
from coop_drake.laws.kernels import governed_acceleration, hand_command, track_row, write_walls
from coop_drake.laws.planar_chain import chain_effort, read_robot
from coop_drake.systems.governor_kernels import cell_margin, govern
from coop_drake.systems.ready_kernels import axis_ready, axis_rests, position_arrived, position_ready
from coop_drake.tree.pose import FloatArray

__all__ = ["FusedCell", "FusedTeam", "team_arrival", "team_command", "team_ready", "team_telemetry"]

IntArray = NDArray[np.int64]


class FusedCell(NamedTuple):
    """One cell for the whole team.

    Attributes:
        gains: (K, zeta, K_G, c).
        edges: Of the governed set, shape (edges, 4) [m].
        flat: The cell's map, as ``VelocityField.kernel_arguments`` has it.
        field: What the velocity field adds to the map.
        table: Laws of the axes (theta, q...), shape (1 + n, ``LAW_COLUMNS``).
    """

    gains: FloatArray
    edges: FloatArray
    flat: FloatArray
    field: FloatArray
    table: FloatArray


class FusedTeam(NamedTuple):
    """The robots side by side; row ``first[k]`` of what is stacked is robot k's first one.

    Attributes:
        places: Where z, then its rates stand in the plant's state, shape (2, 3 + n).
        first: First rows in ``chains`` and ``ways``, first joint, shape (3, N + 1).
        chains: From every robot's base to its hand.
        ways: From the object to every robot's base.
        yaws: Angle of every base in the object, joints at zero, shape (N,) [rad].
        shares: What ``hand_command`` takes of every robot, shape (N, 7).
    """

    places: IntArray
    first: IntArray
    chains: FloatArray
    ways: FloatArray
    yaws: FloatArray
    shares: FloatArray


@compiled
def team_law(
    gains: FloatArray, table: FloatArray, places: IntArray, first: IntArray, chains: FloatArray,
    ways: FloatArray, yaws: FloatArray, shares: FloatArray, time: float, state: FloatArray,
    governor: FloatArray, acceleration: FloatArray, hands: FloatArray, bases: FloatArray, efforts: FloatArray,
) -> None:  # fmt: skip
    """Write the law of (14) to (39) for every robot.

    Args:
        gains: (K, zeta, K_G, c) of the cell.
        table: Laws of all axes in the cell.
        places: With the next five a ``FusedTeam``.
        first: First rows.
        chains: From bases to hands.
        ways: From the object to bases.
        yaws: Of the bases.
        shares: Of the work.
        time: Since the cell was entered [s].
        state: Of the plant.
        governor: p_G, shape (2,) [m].
        acceleration: Receives the object's, shape (3,).
        hands: Receives what ``hand_command`` writes, shape (N, 6).
        bases: Receives the poses of the bases in W, shape (N, 3).
        efforts: Receives wrenches on all bases in W, then all joint torques, shape (3 N + n,).
    """
    robots, n, thing = yaws.size, table.shape[0] - 1, _object_state(places, state)
    governed_acceleration(thing, governor, gains[0], gains[1], acceleration[:2])
    acceleration[2] = track_row(table[0], time, thing[2], thing[5])[0]
    joints, robot, effort = np.empty(n), np.empty(6 + 2 * n), np.empty(3 + n)
    for i in range(n):
        position, rate = state[places[0, 3 + i]], state[places[1, 3 + i]]
        joints[i] = track_row(table[1 + i], time, position, rate)[0]
    for k in range(robots):
        start, stop = first[2, k], first[2, k + 1]
        way, chain = ways[first[1, k] : first[1, k + 1]], chains[first[0, k] : first[0, k + 1]]
        read_robot(way, yaws[k], places[:, 3 + start : 3 + stop], state, robot)
        hand_command(shares[k], thing, acceleration[0], acceleration[1], acceleration[2], hands[k])
        chain_effort(chain, robot, hands[k], joints[start:stop], effort)
        for i in range(3):
            bases[k, i], efforts[3 * k + i] = robot[i], effort[i]
        for i in range(stop - start):
            efforts[3 * robots + start + i] = effort[3 + i]


@compiled
def team_command(
    gains: FloatArray, edges: FloatArray, flat: FloatArray, field: FloatArray, table: FloatArray,
    places: IntArray, first: IntArray, chains: FloatArray, ways: FloatArray, yaws: FloatArray,
    shares: FloatArray, time: float, state: FloatArray, governor: FloatArray, on_bases: bool,
    command: FloatArray,
) -> None:  # fmt: skip
    """Write the wrenches on all bases, all joint torques and p_G'.

    Args:
        gains: With the next four a ``FusedCell``.
        edges: Of the governed set.
        flat: The map.
        field: The velocity field.
        table: Laws of all axes.
        places: With the next five a ``FusedTeam``.
        first: First rows.
        chains: From bases to hands.
        ways: From the object to bases.
        yaws: Of the bases.
        shares: Of the work.
        time: Since the cell was entered [s].
        state: Of the plant.
        governor: p_G, shape (2,) [m].
        on_bases: Whether wrenches are told in the axes of the bases, not in those of W.
        command: Receives them, shape (3 N + n + 2,).
    """
    robots, last = yaws.size, command.size - 2
    acceleration, hands, bases = np.empty(3), np.empty((robots, 6)), np.empty((robots, 3))
    team_law(
        gains, table, places, first, chains, ways, yaws, shares, time, state, governor,
        acceleration, hands, bases, command[:last],
    )  # fmt: skip
    if on_bases:
        for k in range(robots):
            c, s, fx, fy = np.cos(bases[k, 2]), np.sin(bases[k, 2]), command[3 * k], command[3 * k + 1]
            command[3 * k], command[3 * k + 1] = c * fx + s * fy, c * fy - s * fx
    governed = np.empty(4)
    govern(gains, edges, flat, field, _object_state(places, state), governor, governed)
    command[last:] = governed[:2]


@compiled
def team_telemetry(
    gains: FloatArray, edges: FloatArray, table: FloatArray,
    places: IntArray, first: IntArray, chains: FloatArray, ways: FloatArray, yaws: FloatArray,
    shares: FloatArray, time: float, state: FloatArray, governor: FloatArray, walls: FloatArray,
    acceleration: FloatArray, hands: FloatArray, bases: FloatArray, efforts: FloatArray,
) -> float:  # fmt: skip
    """Write what the robots' blocks would tell the log, and return Delta E; arguments as in ``team_law``.

    Args:
        gains: (K, zeta, K_G, c) of the cell.
        edges: Of the governed set.
        table: Laws of all axes in the cell.
        places: Where z and its rates stand in the plant's state.
        first: First rows.
        chains: From bases to hands.
        ways: From the object to bases.
        yaws: Of the bases.
        shares: Of the work.
        time: Since the cell was entered [s].
        state: Of the plant.
        governor: p_G, shape (2,) [m].
        walls: Receives lower, then upper walls of all funnels, shape (2 (1 + n),).
        acceleration: Receives the object's, shape (3,).
        hands: Receives commands of the hands, shape (N, 6).
        bases: Receives poses of the bases, shape (N, 3).
        efforts: Receives all efforts, shape (3 N + n,).
    """
    team_law(
        gains, table, places, first, chains, ways, yaws, shares, time, state, governor,
        acceleration, hands, bases, efforts,
    )  # fmt: skip
    write_walls(table, time, walls)
    return cell_margin(edges, gains[0], _object_state(places, state), governor)


@compiled
def team_ready(
    table: FloatArray, next_table: FloatArray, next_edges: FloatArray, next_gains: FloatArray,
    inradius: float, places: IntArray, first: IntArray, index: int, state: FloatArray, governor: FloatArray,
    reports: FloatArray,
) -> None:  # fmt: skip
    """Write of every robot the cell that it speaks of and its ``ready_margin``, shape (2 N,).

    Args:
        table: Laws of all axes in the current cell.
        next_table: The same in the next one.
        next_edges: Of the next cell.
        next_gains: Of the next cell.
        inradius: R of the present transition [m].
        places: Where z and its rates stand in the plant's state.
        first: First rows of a ``FusedTeam``.
        index: Of the current cell.
        state: Of the plant.
        governor: p_G, shape (2,) [m].
        reports: Receives them.
    """
    thing = _object_state(places, state)
    common = min(
        position_ready(next_edges, next_gains[0], inradius, thing, governor),
        axis_ready(table[0], next_table[0], thing[2], thing[5]),
    )
    for k in range(reports.size // 2):
        margin = common
        for i in range(1 + first[2, k], 1 + first[2, k + 1]):
            position, rate = state[places[0, 2 + i]], state[places[1, 2 + i]]
            margin = min(margin, axis_ready(table[i], next_table[i], position, rate))
        reports[2 * k], reports[2 * k + 1] = index, margin


@compiled
def team_arrival(
    table: FloatArray, goal: FloatArray, tolerance: float, places: IntArray, first: IntArray, index: int,
    state: FloatArray, reports: FloatArray,
) -> None:  # fmt: skip
    """Write of every robot the cell that it speaks of and its ``arrival_margin``, shape (2 N,).

    Args:
        table: Laws of all axes in the last cell.
        goal: Where the object shall end, shape (2,) [m].
        tolerance: How close to it counts as arrived [m].
        places: Where z and its rates stand in the plant's state.
        first: First rows of a ``FusedTeam``.
        index: Of the last cell.
        state: Of the plant.
        reports: Receives them.
    """
    thing = _object_state(places, state)
    common = min(position_arrived(goal, tolerance, thing), axis_rests(table[0], thing[2], thing[5]))
    for k in range(reports.size // 2):
        margin = common
        for i in range(1 + first[2, k], 1 + first[2, k + 1]):
            margin = min(margin, axis_rests(table[i], state[places[0, 2 + i]], state[places[1, 2 + i]]))
        reports[2 * k], reports[2 * k + 1] = index, margin


@compiled
def _object_state(places: IntArray, state: FloatArray) -> FloatArray:
    thing = np.empty(6)
    for i in range(3):
        thing[i], thing[3 + i] = state[places[0, i]], state[places[1, i]]
    return thing
