"""Runs of the compiled loop that nothing of the world ends: what a team does when nobody watches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled_loop.arrays import plant_room, robot_room
from coop_drake.compiled_loop.loop import advance, update
from coop_drake.compiled_loop.preparing import CompiledTransport
from coop_drake.compiled_loop.running import believed, departures_of, memory_of, nominal_of
from coop_drake.compiled_loop.watching import left_by_all
from coop_drake.plant.team import displacement
from coop_drake.scenario import Deployment
from coop_drake.tree.pose import FloatArray


class Unwatched(NamedTuple):
    """How such a run ended.

    Attributes:
        arrived: Whether the supervisor said so.
        time: When, or the end of the run [s].
        z: Configuration then, (x, y, theta, q...) [m, rad].
        cell: The cell then.
    """

    arrived: bool
    time: float
    z: FloatArray
    cell: int


def run_unwatched(transport: CompiledTransport, deployment: Deployment, seconds: float) -> Unwatched:
    """Run a transport until the supervisor says that the team has arrived, or for some time [s]."""
    departures = departures_of(transport, deployment)
    period, memory = float(departures.times[0]), memory_of(transport, departures)
    memory.state[transport.order] += displacement(deployment, len(transport.order))
    team, nominal = believed(transport.team, deployment.mass_error), nominal_of(transport, period)
    room, motion = robot_room(team, memory), plant_room(team, transport.plant)
    for sample in range(round(seconds / period) + 1):
        cell = int(memory.current[sample % len(memory.current), 0])
        z = memory.state[transport.order]
        if cell + 1 == len(transport.plan.cells) and left_by_all(cell, memory.channels):
            return Unwatched(True, sample * period, z, cell)
        if not np.isfinite(memory.state).all():
            break
        update(transport.cells, team, nominal, departures, room, memory, sample)
        advance(sample, team, transport.plant, departures, memory, motion)
    return Unwatched(False, sample * period, z, cell)
