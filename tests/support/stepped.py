"""The compiled loop, sample by sample, without what watches and ends its runs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.compiled_loop import CompiledTransport
from coop_drake.compiled_loop.arrays import LoopMemory, plant_room, robot_room
from coop_drake.compiled_loop.loop import advance, update
from coop_drake.compiled_loop.running import believed, departures_of, memory_of, nominal_of
from coop_drake.plant.team import displacement
from coop_drake.scenario import Deployment


def samples(transport: CompiledTransport, deployment: Deployment) -> Iterator[tuple[float, LoopMemory]]:
    """The time of every sample [s], and the state of the team and of all that robots remember then."""
    departures, nominal = departures_of(transport, deployment), nominal_of(transport, deployment)
    memory, sample = memory_of(transport, departures), 0
    memory.state[transport.order] += displacement(deployment, len(transport.order))
    team = believed(transport.team, deployment.mass_error)
    room, motion = robot_room(team, memory), plant_room(team, transport.plant)
    while np.isfinite(memory.state).all():
        yield sample * float(departures.times[0]), memory
        update(transport.cells, team, nominal, departures, room, memory, sample)
        advance(sample, team, transport.plant, departures, memory, motion)
        sample += 1


def assert_moves_as(
    transport: CompiledTransport, deployment: Deployment, log: SimulationLog, close: float = 1e-5
) -> None:
    """At every sample z is that of Drake's log but for the error of its integrator, and so are its rates.

    Args:
        transport: What the compiled loop runs.
        deployment: What departs.
        log: The log of the same run in Drake.
        close: Largest difference of positions, angles and joints [m, rad]; larger where wheels or joints
            stick or slip or something pushes. Rates may differ by as much in a twentieth of a second.
    """
    order, n, rows = transport.order, len(transport.order), 0
    expected = np.hstack([log.object_pose, log.joints, log.object_twist, log.joint_rates])
    allowed = close * np.repeat([1.0, 20.0], n)
    for time, memory in samples(transport, deployment):
        row = int(np.argmin(np.abs(log.times - time)))
        if abs(log.times[row] - time) > 1e-9:
            break
        away = np.abs(np.concatenate([memory.state[order], memory.state[n + order]]) - expected[row])
        assert (away <= allowed).all(), (time, away)
        rows += 1
    assert rows > 50
