"""Reads from a running closed loop everything that the log keeps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.framework import Context, System

from coop_drake.control.load_sharing import rotate, total_wrench
from coop_drake.diagram import TELEMETRY, ClosedLoop
from coop_drake.geometry.pose import FloatArray

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
        self._states = [
            port_reader(loop.station.diagram, f"robot_{robot.index}_state", root)
            for robot in self._team.robots
        ]
        self._lower, self._upper = _funnel_places([len(robot.joints) for robot in self._team.robots])
        self._of_robots = {
            name: [port_reader(law, name, root) for law in loop.laws] for name in ("ready", *TELEMETRY)
        }
        self._of_robots["robot_effort"] = [port_reader(c, "robot_effort", root) for c in loop.controllers]
        self._current_cell = port_reader(loop.cell_planner, "current_cell", root)
        self._arrived = port_reader(loop.cell_planner, "arrived", root)
        self._accelerations = port_reader(loop.station.diagram, "generalized_acceleration", root)

    def read(self) -> Sample:
        """Read the present instant."""
        team, state = self._team, self._team.plant.GetPositionsAndVelocities(self._plant_context)
        z = state[team.position_index]
        cell, entry = self._current_cell()
        efforts, hands = self._from_robots("robot_effort"), np.array(self._from_robots("hand_command"))
        base_wrenches = np.array([effort[:3] for effort in efforts])
        funnels = np.concatenate([self._of_robots["angle_funnel"][0](), *self._from_robots("joint_funnels")])
        governors = np.array(self._from_robots("governor_position"))
        offsets = rotate(z[2], self._grasps.T).T
        com_offset = rotate(z[2], team.object_inertia.p_LLcm)
        return Sample(
            time=self._root.get_time(),
            cell=int(cell),
            entry=float(entry),
            z=z,
            rates=state[team.plant.num_positions() + team.velocity_index],
            base_poses=np.array([read()[:3] for read in self._states]),
            governor_position=governors[0],
            governor_spread=float(np.abs(governors - governors[0]).max()),
            funnel_lower=funnels[self._lower],
            funnel_upper=funnels[self._upper],
            energy_margin=float(min(self._from_robots("energy_margin"))[0]),
            object_wrench=total_wrench(hands[:, 3:], offsets, com_offset=com_offset),
            commanded_wrenches=hands[:, 3:],
            measured_wrenches=team.grasps.wrenches(self._plant_context, base_wrenches),
            grasp_error=float(team.grasps.errors(self._plant_context).max()),
            base_wrenches=base_wrenches,
            joint_torques=np.concatenate([effort[3:] for effort in efforts]),
            acceleration_error=self._acceleration_error(),
            ready_margins=np.array([margin for _, margin in self._from_robots("ready")]),
            arrived=bool(self._arrived()[0]),
        )

    def _from_robots(self, output: str) -> list[FloatArray]:
        return [read() for read in self._of_robots[output]]

    def _acceleration_error(self) -> float:
        realised = self._accelerations()[self._team.velocity_index[:3]]
        return float(np.abs(np.array(self._from_robots("object_acceleration")) - realised).max())


def _funnel_places(joints: list[int]) -> tuple[list[int], list[int]]:
    """Where lower and upper walls stand when the angle's and every robot's funnels are put in one row."""
    lower, upper, first = [0], [1], 2
    for n in joints:
        lower.extend(range(first, first + n))
        upper.extend(range(first + n, first + 2 * n))
        first += 2 * n
    return lower, upper


def port_reader(system: System, output: str, root: Context) -> Callable[[], Any]:
    """A function that evaluates one output; looking ports and contexts up takes longer than reading them."""
    port, context = system.GetOutputPort(output), system.GetMyContextFromRoot(root)
    return lambda: port.Eval(context)
