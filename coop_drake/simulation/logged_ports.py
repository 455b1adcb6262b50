"""The ports of a running loop that are logged, and where their values stand in one row."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.framework import Context, System

from coop_drake.diagram import TELEMETRY, ClosedLoop, Loop, World
from coop_drake.systems.departure_monitor import ALARM_SIZE
from coop_drake.systems.team_kernels import telemetry_parts
from coop_drake.tree.pose import FloatArray


class ReportingLoop(Loop, ABC):
    """A loop that says itself which of its ports are logged."""

    @abstractmethod
    def places(self, ports: PortRow) -> Places:
        """Add all outputs that are logged to a row, and return where they stand."""


LoggedLoop = ClosedLoop | World | ReportingLoop
"""A loop that can be run."""


class PortRow:
    """The values of many ports in one row.

    Args:
        root: Context of the whole diagram; every reading is of its present content.
    """

    def __init__(self, root: Context) -> None:
        self._root = root
        self._readers: list[Callable[[], FloatArray]] = []
        self._size = 0

    def add(self, system: System, output: str) -> Any:
        """Append an output and return its indices in the row."""
        first = self._size
        self._readers.append(port_reader(system, output, self._root))
        self._size += system.GetOutputPort(output).size()
        return np.arange(first, self._size)

    def read(self) -> FloatArray:
        """The present values of all ports."""
        return np.concatenate([read() for read in self._readers])


class Places(NamedTuple):
    """Indices in a row of ports of the parts of a sample, as integer arrays of the parts' shapes."""

    instant: Any
    base_poses: Any
    governors: Any
    funnel_lower: Any
    funnel_upper: Any
    energy_margins: Any
    commanded_wrenches: Any
    base_wrenches: Any
    joint_torques: Any
    accelerations: Any
    realised: Any
    ready_margins: Any
    clock_lag: Any
    causes: Any
    alarms: Any


def places_of(loop: LoggedLoop, ports: PortRow) -> Places:
    """Add to a row all outputs of a loop that are logged, and return where they stand."""
    if isinstance(loop, World):
        return _world_places(loop, ports)
    if not isinstance(loop, ClosedLoop):
        return loop.places(ports)
    return _fused_places(loop, ports) if loop.fused else _named_places(loop, ports)


def _instant(loop: ClosedLoop, ports: PortRow) -> Any:
    """Add the current cell, its time of entry and whether the team has arrived."""
    return np.concatenate([ports.add(loop.cell_planner, name) for name in ("current_cell", "arrived")])


def _realised(loop: ClosedLoop | World, ports: PortRow) -> Any:
    """Add the accelerations of z in the plant, shape (3 + n,)."""
    return ports.add(loop.station.diagram, "generalized_acceleration")[loop.team.velocity_index]


def _causes(loop: ClosedLoop, ports: PortRow) -> Any:
    """Add the causes of holds, none where a scenario has no holds."""
    return [] if loop.supervisor is None else ports.add(loop.supervisor, "causes")


def _named_places(loop: ClosedLoop, ports: PortRow) -> Places:
    """Add all outputs that are read from a loop of named blocks."""
    robots = loop.team.robots
    states = [ports.add(loop.station.diagram, f"robot_{robot.index}_state") for robot in robots]
    efforts = [ports.add(controller, "robot_effort") for controller in loop.controllers]
    logged = [name for name in TELEMETRY if name != "object_state"]
    of = {name: [ports.add(law, name) for law in loop.bare_controllers] for name in ("ready", *logged)}
    clock = [] if loop.supervisor is None else ports.add(loop.bare_controllers[0], "clock")
    monitored = [law for law in loop.bare_controllers if law.HasOutputPort("alarm")]
    alarms = [ports.add(law, "alarm") for law in monitored]
    # Every robot has bounds for the angle; they are equal, and the first robot's are taken.
    bounds = [np.split(funnels, 2) for funnels in of["funnels"]]
    return Places(
        instant=_instant(loop, ports),
        base_poses=np.array([state[:3] for state in states]),
        governors=np.array(of["governor_position"]),
        funnel_lower=np.concatenate([bounds[0][0][:1], *(lower[1:] for lower, _ in bounds)]),
        funnel_upper=np.concatenate([bounds[0][1][:1], *(upper[1:] for _, upper in bounds)]),
        energy_margins=np.concatenate(of["energy_margin"]),
        commanded_wrenches=np.array(of["hand_command"])[:, 3:],
        base_wrenches=np.array([effort[:3] for effort in efforts]),
        joint_torques=np.concatenate([effort[3:] for effort in efforts]),
        accelerations=np.array(of["object_acceleration"]),
        realised=_realised(loop, ports),
        ready_margins=np.array([margin for _, margin in of["ready"]]),
        clock_lag=np.array(clock[:1], dtype=np.intp),
        causes=np.array(_causes(loop, ports), dtype=np.intp),
        alarms=np.array(alarms, dtype=np.intp).reshape(-1, ALARM_SIZE),
    )


def _fused_places(loop: ClosedLoop, ports: PortRow) -> Places:
    """Add all outputs that are read from a loop of fused blocks."""
    assert loop.fused is not None
    fused, robots = loop.fused, len(loop.team.robots)
    added = ports.add(fused.driver, "telemetry").astype(float)
    acceleration, commands, bases, efforts, bounds, margin = (
        part.astype(np.intp) for part in telemetry_parts(added, robots)
    )
    clock = [] if fused.clock is None else ports.add(fused.clock, "clock")
    governor = fused.integrator.get_output_port().get_name()
    return Places(
        instant=_instant(loop, ports),
        base_poses=bases,
        governors=ports.add(fused.integrator, governor)[None],
        funnel_lower=bounds[: len(bounds) // 2],
        funnel_upper=bounds[len(bounds) // 2 :],
        energy_margins=margin,
        commanded_wrenches=commands[:, 3:],
        base_wrenches=efforts[: 3 * robots].reshape(robots, 3),
        joint_torques=efforts[3 * robots :],
        accelerations=acceleration[None],
        realised=_realised(loop, ports),
        ready_margins=ports.add(fused.driver, "ready")[1::2],
        clock_lag=np.array(clock[:1], dtype=np.intp),
        causes=np.array(_causes(loop, ports), dtype=np.intp),
        alarms=np.empty((0, ALARM_SIZE), dtype=np.intp),
    )


def _world_places(world: World, ports: PortRow) -> Places:
    """Add what robots and supervisor of a world report for the log, and what the world has itself."""
    robots = world.team.robots
    added, records, at = ports.add(world.link, "records"), [], 0
    for names in world.records:
        ends = at + np.cumsum([*names.values()])
        records.append(dict(zip(names, np.split(added[at : ends[-1]], ends[:-1] - at), strict=True)))
        at = ends[-1]
    *own, supervisor = records
    states = [ports.add(world.station.diagram, f"robot_{robot.index}_state") for robot in robots]
    efforts = [ports.add(body.diagram, "robot_effort") for body in world.bodies]
    bounds = [np.split(record["funnels"], 2) for record in own]
    return Places(
        instant=np.concatenate([supervisor["current_cell"], supervisor["arrived"]]),
        base_poses=np.array([state[:3] for state in states]),
        governors=np.array([record["governor_position"] for record in own]),
        funnel_lower=np.concatenate([bounds[0][0][:1], *(lower[1:] for lower, _ in bounds)]),
        funnel_upper=np.concatenate([bounds[0][1][:1], *(upper[1:] for _, upper in bounds)]),
        energy_margins=np.concatenate([record["energy_margin"] for record in own]),
        commanded_wrenches=np.array([record["hand_command"][3:] for record in own]),
        base_wrenches=np.array([effort[:3] for effort in efforts]),
        joint_torques=np.concatenate([effort[3:] for effort in efforts]),
        accelerations=np.array([record["object_acceleration"] for record in own]),
        realised=_realised(world, ports),
        ready_margins=np.array([record["ready"][1] for record in own]),
        clock_lag=own[0]["clock"][:1],
        causes=supervisor["causes"],
        alarms=np.array([record["alarm"] for record in own]).reshape(-1, ALARM_SIZE),
    )


def port_reader(system: System, output: str, root: Context) -> Callable[[], Any]:
    """Return a function that evaluates one output; it looks port and context up only once, to save time."""
    return partial(system.GetOutputPort(output).Eval, system.GetMyContextFromRoot(root))
