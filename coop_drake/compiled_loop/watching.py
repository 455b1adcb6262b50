"""Margins of the compiled loop at every sample, and whether a run has ended.

No point of a body moves further than the position does, plus what every angle and joint moves it at most. A
distance therefore stays above what it was when it was measured last, less the way since then; it is measured
only where it can be the smallest so far.
"""

from __future__ import annotations

from math import hypot, inf

import numpy as np

from coop_drake.compiled_loop.arrays import (
    LoopCells,
    LoopDepartures,
    LoopMemory,
    LoopNominal,
    LoopPlant,
    LoopTeam,
    WatchRoom,
)
from coop_drake.compiled_loop.robots import begun, heard_cell
from coop_drake.geometry.polygons import signed_distance
from coop_drake.jit import compiled
from coop_drake.laws.axis_table import bounds_of
from coop_drake.laws.motion import motion_at
from coop_drake.laws.words import ARRIVED as SEES_ARRIVAL
from coop_drake.laws.words import HELD as SEES_HOLD
from coop_drake.laws.words import HOLD, phase_at
from coop_drake.simulation.clearance import pair_apart, piece_to_walls, place_pieces
from coop_drake.tree.arrays import FloatArray

ROUNDING = 1e-9
"""More than what rounding errors change of a distance and of the way of a run [m]."""

FIGURES = 23
(
    ENDED,
    PLACE,
    FUNNEL,
    FUNNEL_AXIS,
    FUNNEL_CELL,
    REGION,
    WALL,
    BODY,
    SHARE,
    FORCE,
    EFFORT,
    SAMPLES,
    VALUE,
    CELL,
    ROBOT,
    ALARM,
    TORQUE,
    STEP,
    SQUARES,
    TURN,
    SPREAD,
    HOLDS,
    MOVED,
) = range(FIGURES)
"""Figures of a run: how it ended, the axis if one ended it, the smallest distance of an axis to a bound of
its funnel, this axis and its cell, smallest distances of the position to the boundary of its cell, of bodies
to walls and to each other, the largest share of the budget, largest force and joint effort, number of
samples, the value and the cell at the end, the robot that ended it, the largest measured departure over its
level, the largest torque of a base, the largest change of a base's force from sample to sample, the sum over
all samples of the bases' mean squared force, the largest change of the object's rate of rotation,
the largest distance of nominal positions of two robots, how often a team that passes came to rest on its
way, and when it moved on along its motion the last time, or a person held it."""

(
    RUNS,
    ARRIVED,
    ASTRAY,
    STALLED,
    LATE,
    OUT_OF_FUNNEL,
    OUT_OF_SLICE,
    OUT_OF_REGION,
    AT_WALL,
    AT_BODY,
    BRAKED,
) = range(11)
"""How a run may have ended."""


def begin_figures() -> FloatArray:
    """Return the figures of a run that has not begun, shape (``FIGURES``,)."""
    figures = np.zeros(FIGURES)
    figures[[FUNNEL, REGION, WALL, BODY]], figures[[SHARE, ALARM]] = inf, np.nan
    return figures


@compiled(borrows=True)
def end(figures: FloatArray, how: int, value: float, place: int = -1) -> None:
    """Write how a run ended, unless it has ended already."""
    if figures[ENDED] == RUNS:
        figures[ENDED], figures[VALUE], figures[PLACE] = how, value, place


@compiled(inlined=True, borrows=True)
def watch(
    sample: int, cells: LoopCells, team: LoopTeam, plant: LoopPlant, nominal: LoopNominal,
    departures: LoopDepartures, memory: LoopMemory, room: WatchRoom, figures: FloatArray,
) -> None:  # fmt: skip
    """Measure every margin before the updates of a sample, and end the run where there is a reason.

    Args:
        sample: Number of the sample.
        cells: The plan's cells.
        team: The robots' models.
        plant: The simulated team.
        nominal: The nominal motions.
        departures: What departs.
        memory: What changes.
        room: What was measured last.
        figures: Receives the figures of the run.
    """
    z, entered, before = room.z, memory.current[sample % memory.current.shape[0]], room.before
    now, cell, robots, braking, most = sample * departures.times[0], int(entered[0]), team.yaws.size, False, 0
    figures[SAMPLES], figures[CELL] = sample, cell
    for i in range(z.size):
        z[i] = memory.state[team.places[0, i]]

    # Distances of axes to funnels and slices.
    passes = nominal.points.size > 0
    for i in range(z.size - 2):
        k = plant.axis_rows[1, i]
        if passes:  # The funnel is the cell that the robot is in.
            heard = begun(nominal.schedule.begins, memory.phases[(sample - 1) % memory.phases.shape[0], k, 0])
            lower, upper = cells.slices[0, heard, i], cells.slices[1, heard, i]
        else:
            heard, time = heard_cell(k, sample, now, departures.hearing, memory.current)
            bounds = bounds_of(cells.tables[heard, plant.axis_rows[0, i]], time)
            lower, upper = bounds[0], bounds[1]
        margin = min(z[2 + i] - lower, upper - z[2 + i])
        if margin < figures[FUNNEL]:
            figures[FUNNEL], figures[FUNNEL_AXIS], figures[FUNNEL_CELL] = margin, i, cell
        if not margin > 0.0:
            end(figures, OUT_OF_FUNNEL, margin, i)
        lower, upper = cells.slices[0, cell, i], cells.slices[1, cell, i]
        margin = min(z[2 + i] - lower, upper - z[2 + i])
        if not margin > 0.0:
            end(figures, OUT_OF_SLICE, margin, i)

    # The distance to the cell's boundary and clearances; the run ends where one is not positive.
    last, way, x, y, shapes, reach = room.region, room.way, z[0], z[1], plant.shapes, plant.reach
    if not (last[0] == cell and last[1] - hypot(x - last[2], y - last[3]) > figures[REGION] + ROUNDING):
        inside = signed_distance(cells.regions[cells.first[1, cell] : cells.first[1, cell + 1]], x, y)
        last[0], last[1], last[2], last[3] = cell, inside, x, y
        figures[REGION] = min(figures[REGION], inside)
        if not inside > 0.0:
            end(figures, OUT_OF_REGION, inside)
    between = 0.0
    for i in range(1, reach.size):
        between += reach[i] * abs(z[2 + i] - room.last_z[2 + i])
    moved = hypot(x - room.last_z[0], y - room.last_z[1]) + reach[0] * abs(z[2] - room.last_z[2])
    moved += between
    if moved >= 0.0:  # Not NaN: there was a configuration before.
        way[0] += moved
        way[1] += 2.0 * between
    for i in range(z.size):
        room.last_z[i] = z[i]
    placed = False
    for i in range(len(shapes.pieces)):
        if room.walls[i, 0] - (way[0] - room.walls[i, 1]) > figures[WALL] + ROUNDING:
            continue
        if not placed:
            place_pieces(shapes, z, room.poses, room.vertices, room.discs)
            placed = True
        distance = piece_to_walls(shapes, room.vertices, room.discs, plant.walls, i, inf)
        room.walls[i, 0], room.walls[i, 1] = distance, way[0]
        figures[WALL] = min(figures[WALL], distance)
    for i in range(len(shapes.pairs)):
        if room.pairs[i, 0] - (way[1] - room.pairs[i, 1]) > figures[BODY] + ROUNDING:
            continue
        if not placed:
            place_pieces(shapes, z, room.poses, room.vertices, room.discs)
            placed = True
        distance = pair_apart(shapes, room.vertices, room.discs, i, inf)
        room.pairs[i, 0], room.pairs[i, 1] = distance, way[1]
        figures[BODY] = min(figures[BODY], distance)
    if not figures[WALL] > 0.0:
        end(figures, AT_WALL, figures[WALL])
    if not figures[BODY] > 0.0:
        end(figures, AT_BODY, figures[BODY])

    # How far the robots' nominal positions are apart, and departures of position, velocity, axes and their
    # rates from their nominal motions.
    if passes:
        for k in range(robots):
            place = room.nominal[k]
            clock = now + departures.hearing[0, k]
            phase, pace, _ = phase_at(nominal.schedule, memory.motions[k], clock)
            motion_at(nominal.points, nominal.span, phase, pace, 0.0, place)
            if pace > 0.0 or memory.supervised[0] == SEES_HOLD:
                figures[MOVED] = now
            for j in range(k):
                apart = hypot(place[0, 0] - room.nominal[j, 0, 0], place[0, 1] - room.nominal[j, 0, 1])
                figures[SPREAD] = max(figures[SPREAD], apart)
        figures[HOLDS] = memory.supervised[2]
        if nominal.stated.size:
            for i in range(z.size):
                place = rate = 0.0
                for k in range(robots):
                    place += room.nominal[k, 0, i] / robots
                    rate += room.nominal[k, 1, i] / robots
                room.off[0, i], room.off[1, i] = z[i] - place, memory.state[team.places[1, i]] - rate
                room.off[2, i] = nominal.schedule.clock_error * rate
            used = 0.0
            for row in range(2):
                moved = hypot(room.off[2, 0], room.off[2, 1]) if row == 0 else 0.0
                away = hypot(room.off[row, 0], room.off[row, 1])
                used = max(used, away / (nominal.stated[row, 0] + moved))
                for i in range(2, z.size):
                    moved = abs(room.off[2, i]) if row == 0 else 0.0
                    used = max(used, abs(room.off[row, i]) / (nominal.stated[row, i - 1] + moved))
            if not figures[SHARE] > used:
                figures[SHARE] = used

    # Efforts of all robots, the object's rotation, and what the robots' monitors say: the run ends where one
    # lets the drives brake; the robot is named that departs most.
    for k in range(robots):
        own = 3 * k + team.first[2, k]
        x, y = memory.efforts[1, own], memory.efforts[1, own + 1]
        if abs(x) + abs(y) > figures[FORCE]:  # It is at least the force, and quicker to compute.
            figures[FORCE] = max(figures[FORCE], hypot(x, y))
        figures[TORQUE] = max(figures[TORQUE], abs(memory.efforts[1, own + 2]))
        figures[SQUARES] += (x * x + y * y) / robots
        step = hypot(x - before[2 * k], y - before[2 * k + 1])
        if step > figures[STEP]:
            figures[STEP] = step
        before[2 * k], before[2 * k + 1] = x, y
        for i in range(team.first[2, k + 1] - team.first[2, k]):
            figures[EFFORT] = max(figures[EFFORT], abs(memory.efforts[1, own + 3 + i]))
        if nominal.levels.size and not figures[ALARM] > memory.alarms[k, 1]:
            figures[ALARM] = memory.alarms[k, 1]
        braking = braking or (passes and memory.words[robots, k, HOLD] == -inf)
        if memory.alarms[k, 1] > memory.alarms[most, 1]:
            most = k
    rate = memory.state[team.places[1, 2]]
    turn = abs(rate - before[-1])
    if turn > figures[TURN]:
        figures[TURN] = turn
    before[-1] = rate
    if braking and figures[ENDED] == RUNS:
        figures[ROBOT] = most
        end(figures, BRAKED, memory.alarms[most, 1], int(memory.alarms[most, 2]))

    time = now - entered[1]
    if passes:
        arrived = memory.supervised[0] == SEES_ARRIVAL
    else:
        arrived = cell + 1 == cells.rows.shape[0] and left_by_all(cell, memory.channels)
    if arrived:
        # How far object and joints are off the goal over what is tolerated, whatever was measured [-].
        away = 0.0
        for k in range(robots):
            first, n = team.first[2, k], team.first[2, k + 1] - team.first[2, k]
            place, tolerances = cells.places[3 * k + first :], cells.rooms[0, 2 * k + first :]
            away = max(away, hypot(z[0] - place[0], z[1] - place[1]) / tolerances[0])
            away = max(away, abs(z[2] - place[2]) / tolerances[1])
            for i in range(n):
                away = max(away, abs(z[3 + first + i] - place[3 + i]) / tolerances[2 + i])
        end(figures, ARRIVED if away <= 1.0 else ASTRAY, away)
    elif (now - figures[MOVED] if passes else time) > cells.numbers[cell, 2]:
        end(figures, STALLED, time)
    elif now >= departures.times[1]:
        end(figures, LATE, time)


@compiled(borrows=True)
def left_by_all(cell: int, channels: FloatArray) -> bool:
    """Whether the reports heard say that all robots are ready to leave a cell, as the cell planner judges."""
    for k in range(channels.shape[0]):
        if channels[k, 0, 0] != cell or not channels[k, 0, 1] >= 0.0:
            return False
    return True
