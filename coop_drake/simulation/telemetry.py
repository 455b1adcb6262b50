"""Reads from a running closed loop everything that the log keeps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.framework import Context, System

from coop_drake.diagram import TELEMETRY, ClosedLoop
from coop_drake.simulation.step_kernels import largest_difference, object_wrench
from coop_drake.tree.pose import FloatArray

__all__ = ["Sample", "Telemetry", "port_reader"]


@dataclass(frozen=True)
class Sample:
    """One instant of a run; names, units and frames as in ``SimulationLog``, without the leading axis.

    Attributes:
        time: Simulated time [s].
        cell: Index of the current cell.
        entry: Time at which it was entered [s].
        z: Configuration, shape (3 + n,).
        rates: Rates of z, shape (3 + n,).
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
        arrived: Whether all robots report arrival.
    """

    time: float
    cell: int
    entry: float
    z: FloatArray
    rates: FloatArray
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
    arrived: bool


class Telemetry:
    """Evaluates the ports of a closed loop.

    Args:
        loop: The closed loop.
        root: Context of the whole diagram; every reading is of its present content.
    """

    def __init__(self, loop: ClosedLoop, root: Context) -> None:
        self._team, self._root = loop.team, root
        self._plant_context = self._team.plant.GetMyContextFromRoot(root)
        self._grasps = np.array([[robot.X_LE.x, robot.X_LE.y] for robot in self._team.robots])
        self._rates = self._team.plant.num_positions() + self._team.velocity_index
        self._ports = _PortRow(root)
        self._places = _places(loop, self._ports)

    def read(self) -> Sample:
        """Read the present instant."""
        team, at, values = self._team, self._places, self._ports.read()
        state = team.plant.GetPositionsAndVelocities(self._plant_context)
        z, governors = state[team.position_index], values[at.governors]
        base_wrenches, commanded = values[at.base_wrenches], values[at.commanded_wrenches]
        cell, entry, arrived = values[at.instant]
        return Sample(
            time=self._root.get_time(),
            cell=int(cell),
            entry=float(entry),
            z=z,
            rates=state[self._rates],
            base_poses=values[at.base_poses],
            governor_position=governors[0],
            governor_spread=largest_difference(governors, governors[:1]),
            funnel_lower=values[at.funnel_lower],
            funnel_upper=values[at.funnel_upper],
            energy_margin=float(values[at.energy_margins].min()),
            object_wrench=object_wrench(commanded, self._grasps, team.object_inertia.p_LLcm, z[2]),
            commanded_wrenches=commanded,
            measured_wrenches=team.grasps.wrenches(self._plant_context, base_wrenches),
            grasp_error=float(team.grasps.errors(self._plant_context).max()),
            base_wrenches=base_wrenches,
            joint_torques=values[at.joint_torques],
            acceleration_error=largest_difference(values[at.accelerations], values[at.realised]),
            ready_margins=values[at.ready_margins],
            arrived=bool(arrived),
        )


class _PortRow:
    """The values of many ports in one row.

    Args:
        root: Context of the whole diagram.
    """

    def __init__(self, root: Context) -> None:
        self._root = root
        self._readers: list[Callable[[], FloatArray]] = []
        self._size = 0

    def add(self, system: System, output: str) -> Any:
        """Append an output; returns where in the row it stands, integers."""
        first = self._size
        self._readers.append(port_reader(system, output, self._root))
        self._size += system.GetOutputPort(output).size()
        return np.arange(first, self._size)

    def read(self) -> FloatArray:
        """The present values of all ports."""
        return np.concatenate([read() for read in self._readers])


class _Places(NamedTuple):
    """Where in a row of ports the parts of a sample stand, as integers of the parts' shapes."""

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


def _places(loop: ClosedLoop, ports: _PortRow) -> _Places:
    """Add everything that is read of a loop to a row."""
    station, planner = loop.station.diagram, loop.cell_planner
    states = [ports.add(station, f"robot_{robot.index}_state") for robot in loop.team.robots]
    efforts = [ports.add(controller, "robot_effort") for controller in loop.controllers]
    logged = [name for name in TELEMETRY if name != "object_state"]
    of = {name: [ports.add(law, name) for law in loop.laws] for name in ("ready", *logged)}
    realised = ports.add(station, "generalized_acceleration")[loop.team.velocity_index[:3]]
    # Every robot has walls for the angle; they are alike, and the first robot's are taken.
    walls = [np.split(funnels, 2) for funnels in of["funnels"]]
    return _Places(
        instant=np.concatenate([ports.add(planner, "current_cell"), ports.add(planner, "arrived")]),
        base_poses=np.array([state[:3] for state in states]),
        governors=np.array(of["governor_position"]),
        funnel_lower=np.concatenate([walls[0][0][:1], *(lower[1:] for lower, _ in walls)]),
        funnel_upper=np.concatenate([walls[0][1][:1], *(upper[1:] for _, upper in walls)]),
        energy_margins=np.concatenate(of["energy_margin"]),
        commanded_wrenches=np.array(of["hand_command"])[:, 3:],
        base_wrenches=np.array([effort[:3] for effort in efforts]),
        joint_torques=np.concatenate([effort[3:] for effort in efforts]),
        accelerations=np.array(of["object_acceleration"]),
        realised=realised[None],
        ready_margins=np.array([margin for _, margin in of["ready"]]),
    )


def port_reader(system: System, output: str, root: Context) -> Callable[[], Any]:
    """A function that evaluates one output; looking ports and contexts up takes longer than reading them."""
    return partial(system.GetOutputPort(output).Eval, system.GetMyContextFromRoot(root))
