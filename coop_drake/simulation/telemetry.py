"""Reads from a running closed loop all that the log contains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.framework import Context, System

from coop_drake.compiled import prepared
from coop_drake.diagram import TELEMETRY, ClosedLoop, World
from coop_drake.laws import total_wrench
from coop_drake.simulation.step_kernels import row_figures
from coop_drake.systems.block import NUMBER
from coop_drake.systems.team_kernels import telemetry_parts
from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class Sample:
    """One instant of a run; names, units and frames as in ``SimulationLog``, without the leading axis.

    Attributes:
        time: Simulated time [s].
        cell: Index of the current cell.
        entry: Time at which it was entered [s].
        z: Configuration, shape (3 + n,).
        rates: Rates of z, shape (3 + n,).
        accelerations: Accelerations of z in the plant, shape (3 + n,).
        base_poses: Shape (N, 3).
        governor_position: As robot 0 keeps it, shape (2,).
        governor_spread: Largest difference to the other robots' copies.
        funnel_lower: Shape (1 + n,).
        funnel_upper: Shape (1 + n,).
        energy_margin: Smallest over the robots.
        object_wrench: Shape (3,).
        commanded_wrenches: Shape (N, 3).
        measured_wrenches: Shape (N, 3).
        grasp_error: Largest over the robots.
        base_wrenches: Shape (N, 3).
        joint_torques: Shape (n,).
        acceleration_error: Largest component over all robots' commands.
        ready_margins: As every robot reports it, shape (N,).
        held: Whether the team is held, 1 or 0.
        clock_lag: Lag of the funnels' clock since the cell was entered.
        causes: Why the team is held, as the hold supervisor shows it; empty where it cannot be.
        arrived: Whether all robots report arrival.
    """

    time: float
    cell: int
    entry: float
    z: FloatArray
    rates: FloatArray
    accelerations: FloatArray
    base_poses: FloatArray
    governor_position: FloatArray
    governor_spread: float
    funnel_lower: FloatArray
    funnel_upper: FloatArray
    energy_margin: float
    object_wrench: FloatArray
    commanded_wrenches: FloatArray
    measured_wrenches: FloatArray
    grasp_error: float
    base_wrenches: FloatArray
    joint_torques: FloatArray
    acceleration_error: float
    ready_margins: FloatArray
    held: float
    clock_lag: float
    causes: FloatArray
    arrived: bool


class Telemetry:
    """Evaluates the ports of a closed loop, of named or of fused blocks.

    Args:
        loop: The closed loop.
        root: Context of the whole diagram; every reading is of its present content.
    """

    def __init__(self, loop: ClosedLoop | World, root: Context) -> None:
        self._team, self._root = loop.team, root
        self._plant_context = self._team.plant.GetMyContextFromRoot(root)
        rates = self._team.plant.num_positions() + self._team.velocity_index
        self._z = len(self._team.position_index)
        self._own = np.concatenate([self._team.position_index, rates])
        self._ports = _PortRow(root)
        places = [np.asarray(part, dtype=np.intp) for part in _places(loop, self._ports)]
        self._order = np.concatenate([part.ravel() for part in places])
        ends = np.cumsum([part.size for part in places]).tolist()
        parts = zip(places, ends, strict=True)
        self._parts = [(slice(end - part.size, end), part.shape) for part, end in parts]
        at, none = (
            _Places(*[np.empty(part.shape) for part in places]),
            self._team.grasps.errors(self._plant_context),
        )
        figures = at.governors, at.accelerations, at.realised, at.energy_margins, none
        self._figures = prepared(row_figures, (), *figures, at.clock_lag, at.causes)
        grasps = np.array([[robot.X_LE.x, robot.X_LE.y] for robot in self._team.robots])
        self._load = grasps, self._team.object_inertia.p_LLcm
        self._total = prepared(total_wrench, (), at.commanded_wrenches, *self._load, NUMBER)

    def read(self) -> Sample:
        """Read the present instant."""
        team, row = self._team, self._ports.read()[self._order]
        at = _Places(*[row[part].reshape(shape) for part, shape in self._parts])
        state = team.plant.GetPositionsAndVelocities(self._plant_context)[self._own]
        z, errors = state[: self._z], team.grasps.errors(self._plant_context)
        spread, difference, margin, error, lag, held = self._figures(
            *(at.governors, at.accelerations, at.realised, at.energy_margins, errors, at.clock_lag, at.causes)
        )
        cell, entry, arrived = at.instant.tolist()
        return Sample(
            time=self._root.get_time(),
            cell=int(cell),
            entry=entry,
            z=z,
            rates=state[self._z :],
            accelerations=at.realised,
            base_poses=at.base_poses,
            governor_position=at.governors[0],
            governor_spread=spread,
            funnel_lower=at.funnel_lower,
            funnel_upper=at.funnel_upper,
            energy_margin=margin,
            object_wrench=self._total(at.commanded_wrenches, *self._load, float(z[2])),
            commanded_wrenches=at.commanded_wrenches,
            measured_wrenches=team.grasps.wrenches(self._plant_context),
            grasp_error=error,
            base_wrenches=at.base_wrenches,
            joint_torques=at.joint_torques,
            acceleration_error=difference,
            ready_margins=at.ready_margins,
            held=held,
            clock_lag=lag,
            causes=at.causes,
            arrived=bool(arrived),
        )


class _PortRow:
    """The values of many ports in one row."""

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


class _Places(NamedTuple):
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


def _places(loop: ClosedLoop | World, ports: _PortRow) -> _Places:
    if isinstance(loop, World):
        return _world_places(loop, ports)
    return _fused_places(loop, ports) if loop.fused else _named_places(loop, ports)


def _instant(loop: ClosedLoop, ports: _PortRow) -> Any:
    """Add the current cell, its time of entry and whether the team has arrived."""
    return np.concatenate([ports.add(loop.cell_planner, name) for name in ("current_cell", "arrived")])


def _realised(loop: ClosedLoop | World, ports: _PortRow) -> Any:
    """Add the accelerations of z in the plant, shape (3 + n,)."""
    return ports.add(loop.station.diagram, "generalized_acceleration")[loop.team.velocity_index]


def _causes(loop: ClosedLoop, ports: _PortRow) -> Any:
    """Add the causes of holds, none where a scenario has no holds."""
    return [] if loop.supervisor is None else ports.add(loop.supervisor, "causes")


def _named_places(loop: ClosedLoop, ports: _PortRow) -> _Places:
    """Add all outputs that are read from a loop of named blocks."""
    robots = loop.team.robots
    states = [ports.add(loop.station.diagram, f"robot_{robot.index}_state") for robot in robots]
    efforts = [ports.add(controller, "robot_effort") for controller in loop.controllers]
    logged = [name for name in TELEMETRY if name != "object_state"]
    of = {name: [ports.add(law, name) for law in loop.bare_controllers] for name in ("ready", *logged)}
    clock = [] if loop.supervisor is None else ports.add(loop.bare_controllers[0], "clock")
    # Every robot has bounds for the angle; they are equal, and the first robot's are taken.
    bounds = [np.split(funnels, 2) for funnels in of["funnels"]]
    return _Places(
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
    )


def _fused_places(loop: ClosedLoop, ports: _PortRow) -> _Places:
    """Add all outputs that are read from a loop of fused blocks."""
    assert loop.fused is not None
    fused, robots = loop.fused, len(loop.team.robots)
    added = ports.add(fused.driver, "telemetry").astype(float)
    acceleration, commands, bases, efforts, bounds, margin = (
        part.astype(np.intp) for part in telemetry_parts(added, robots)
    )
    clock = [] if fused.clock is None else ports.add(fused.clock, "clock")
    governor = fused.governor_position
    wrenches, torques = efforts[: 3 * robots].reshape(robots, 3), efforts[3 * robots :]
    if fused.efforts:
        held = [ports.add(port.get_system(), port.get_name()) for port in fused.efforts]
        wrenches = np.array([effort[:3] for effort in held])
        torques = np.concatenate([effort[3:] for effort in held])
    return _Places(
        instant=_instant(loop, ports),
        base_poses=bases,
        governors=ports.add(governor.get_system(), governor.get_name())[None],
        funnel_lower=bounds[: len(bounds) // 2],
        funnel_upper=bounds[len(bounds) // 2 :],
        energy_margins=margin,
        commanded_wrenches=commands[:, 3:],
        base_wrenches=wrenches,
        joint_torques=torques,
        accelerations=acceleration[None],
        realised=_realised(loop, ports),
        ready_margins=ports.add(fused.driver, "ready")[1::2],
        clock_lag=np.array(clock[:1], dtype=np.intp),
        causes=np.array(_causes(loop, ports), dtype=np.intp),
    )


def _world_places(world: World, ports: _PortRow) -> _Places:
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
    return _Places(
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
    )


def port_reader(system: System, output: str, root: Context) -> Callable[[], Any]:
    """Return a function that evaluates one output; it looks port and context up only once, to save time."""
    return partial(system.GetOutputPort(output).Eval, system.GetMyContextFromRoot(root))
