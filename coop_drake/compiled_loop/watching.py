"""Margins of the compiled loop at every sample, and whether a run has ended."""

from __future__ import annotations

from math import hypot, inf, isnan

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.compiled_loop.arrays import LoopCells, LoopDepartures, LoopMemory, LoopNominal, LoopPlant
from coop_drake.compiled_loop.robots import heard_cell
from coop_drake.geometry.boundary import signed_distance
from coop_drake.laws.axis_table import GOAL_LOWER, GOAL_UPPER, bounds_of
from coop_drake.laws.readiness import interval_margin, position_arrival
from coop_drake.simulation.step_kernels import team_distances
from coop_drake.systems.team_kernels import FusedTeam
from coop_drake.tree.pose import FloatArray

FIGURES = 14
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
) = range(FIGURES)
"""Figures of a run: how it ended, the axis if one ended it, the smallest distance of an axis to a bound of
its funnel, this axis and its cell, smallest distances of the position to the boundary of its cell, of bodies
to walls and to each other, the largest share of the budget, largest force and joint effort, number of
samples, and the value and the cell at the end."""

RUNS, ARRIVED, STALLED, LATE, OUT_OF_FUNNEL, OUT_OF_SLICE, OUT_OF_REGION, AT_WALL, AT_BODY = range(9)
"""How a run may have ended."""


@compiled
def begin_figures() -> FloatArray:
    """Return the figures of a run that has not begun, shape (``FIGURES``,)."""
    figures = np.zeros(FIGURES)
    for i in (FUNNEL, REGION, WALL, BODY):
        figures[i] = inf
    figures[SHARE] = np.nan
    return figures


@compiled
def end(figures: FloatArray, how: int, value: float, place: int = -1) -> None:
    """Write how a run ended, unless it has ended already."""
    if figures[ENDED] == RUNS:
        figures[ENDED], figures[VALUE], figures[PLACE] = how, value, place


@compiled
def watch(
    sample: int, cells: LoopCells, team: FusedTeam, plant: LoopPlant, nominal: LoopNominal,
    departures: LoopDepartures, memory: LoopMemory, measured: FloatArray, figures: FloatArray,
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
        measured: What ``watch_distances`` remembers, shape (5 + n,).
        figures: Receives the figures of the run.
    """
    z, now = np.empty(memory.state.size // 2), sample % memory.current.shape[0]
    for i in range(z.size):
        z[i] = memory.state[team.places[0, i]]
    cell, time = int(memory.current[now, 0]), sample * departures.times[0] - memory.current[now, 1]
    figures[SAMPLES], figures[CELL] = sample, cell
    _watch_cell(sample, cell, z, cells, plant, nominal, departures, memory, figures)
    watch_distances(z, plant, measured, figures)
    if nominal.flow.size:
        led = memory.nominal[sample % memory.nominal.shape[0]]
        _use(hypot(z[0] - led[0], z[1] - led[1]) / nominal.position[2], figures)
    _watch_efforts(team, memory, figures)
    if cell + 1 == cells.rows.shape[0] and left_by_all(cell, memory) and _at_goal(cell, z, cells, plant):
        end(figures, ARRIVED, 0.0)
    elif time > cells.numbers[cell, 2]:
        end(figures, STALLED, time)
    elif sample * departures.times[0] >= departures.times[1]:
        end(figures, LATE, time)


@compiled
def _watch_cell(
    sample: int, cell: int, z: FloatArray, cells: LoopCells, plant: LoopPlant,
    nominal: LoopNominal, departures: LoopDepartures, memory: LoopMemory, figures: FloatArray,
) -> None:  # fmt: skip
    """Measure distances to funnels, slices and the cell's boundary, and end the run where one is negative.

    An axis uses the least distance to its funnel's bounds that the budget states over the one that it keeps.
    """
    for i in range(z.size - 2):
        now = sample * departures.times[0]
        heard, time = heard_cell(plant.axis_rows[1, i], sample, now, departures, memory)
        bounds = bounds_of(cells.tables[heard, plant.axis_rows[0, i]], time)
        margin = min(z[2 + i] - bounds[0], bounds[1] - z[2 + i])
        if margin < figures[FUNNEL]:
            figures[FUNNEL], figures[FUNNEL_AXIS], figures[FUNNEL_CELL] = margin, i, cell
        if not margin > 0.0:
            end(figures, OUT_OF_FUNNEL, margin, i)
        if nominal.distances.size:
            _use(nominal.distances[cell, i] / margin if margin > 0.0 else inf, figures)
        lower, upper = cells.slices[0, cell, i], cells.slices[1, cell, i]
        margin = min(z[2 + i] - lower, upper - z[2 + i])
        if not margin > 0.0:
            end(figures, OUT_OF_SLICE, margin, i)
    edges = cells.regions[cells.first[1, cell] : cells.first[1, cell + 1]]
    inside = signed_distance(edges, z[0], z[1])
    figures[REGION] = min(figures[REGION], inside)
    if not inside > 0.0:
        end(figures, OUT_OF_REGION, inside)


@compiled
def watch_distances(z: FloatArray, plant: LoopPlant, measured: FloatArray, figures: FloatArray) -> None:
    """Measure clearances, unless the team has moved too little since the last time to be nearer than before.

    No point of a body moves further than the position, plus what every angle and joint moves it at most.
    Of two bodies, the motion of the object does not change the distance.

    Args:
        z: (x, y, theta, q), shape (3 + n,) [m, rad].
        plant: The simulated team.
        measured: Distances to walls and between bodies, then z, when they were measured last, shape (5 + n,);
            the first one is NaN before.
        figures: Receives the smallest distances.
    """
    between = 0.0
    for i in range(1, plant.reach.size):
        between += plant.reach[i] * abs(z[2 + i] - measured[4 + i])
    moved = hypot(z[0] - measured[2], z[1] - measured[3]) + plant.reach[0] * abs(z[2] - measured[4]) + between
    if measured[0] - moved > figures[WALL] and measured[1] - 2.0 * between > figures[BODY]:
        return
    wall, _, body, _ = team_distances(plant.shapes, plant.walls, z)
    measured[0], measured[1], measured[2:] = wall, body, z
    figures[WALL], figures[BODY] = min(figures[WALL], wall), min(figures[BODY], body)
    if not wall > 0.0:
        end(figures, AT_WALL, wall)
    if not body > 0.0:
        end(figures, AT_BODY, body)


@compiled
def _use(share: float, figures: FloatArray) -> None:
    """Note which share was used of what the plan's budget states."""
    if isnan(figures[SHARE]) or share > figures[SHARE]:
        figures[SHARE] = share


@compiled
def _watch_efforts(team: FusedTeam, memory: LoopMemory, figures: FloatArray) -> None:
    """Measure the largest force of a base and the largest effort of a joint."""
    for k in range(team.yaws.size):
        own = 3 * k + team.first[2, k]
        force = hypot(memory.efforts[1, own], memory.efforts[1, own + 1])
        figures[FORCE] = max(figures[FORCE], force)
        for i in range(team.first[2, k + 1] - team.first[2, k]):
            figures[EFFORT] = max(figures[EFFORT], abs(memory.efforts[1, own + 3 + i]))


@compiled
def left_by_all(cell: int, memory: LoopMemory) -> bool:
    """Whether the reports heard say that all robots are ready to leave a cell, as the cell planner judges."""
    for k in range(memory.channels.shape[0]):
        if memory.channels[k, 0, 0] != cell or not memory.channels[k, 0, 1] >= 0.0:
            return False
    return True


@compiled
def _at_goal(cell: int, z: FloatArray, cells: LoopCells, plant: LoopPlant) -> bool:
    """Whether the object and the joints are where the plan ends, whatever was measured."""
    for i in range(z.size - 2):
        row = cells.tables[cell, plant.axis_rows[0, i]]
        if not interval_margin(z[2 + i], row[GOAL_LOWER], row[GOAL_UPPER]) >= 0.0:
            return False
    away = hypot(z[0] - cells.goal[0], z[1] - cells.goal[1])
    return bool(position_arrival(away, 0.0, cells.tolerances[1]) >= 0.0)
