"""Reads from a running closed loop everything that the log keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Context

from coop_drake.control.load_sharing import rotate, total_wrench
from coop_drake.diagram import ClosedLoop
from coop_drake.geometry.pose import FloatArray
from coop_drake.plant import RobotModel, base_poses

__all__ = ["Sample", "Telemetry"]


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
        funnel_lower: Shape (1 + n,).
        funnel_upper: Shape (1 + n,).
        energy_margin: Smallest over the robots.
        object_wrench: Shape (3,).
        commanded_wrenches: Shape (N, 3).
        measured_wrenches: Shape (N, 3).
        base_wrenches: Shape (N, 3).
        joint_torques: Shape (n,).
        acceleration_error: Largest component over all robots' commands.
        arrived: Whether all robots report arrival.
    """

    time: float
    cell: int
    entry: float
    z: FloatArray
    rates: FloatArray
    base_poses: FloatArray
    governor_position: FloatArray
    funnel_lower: FloatArray
    funnel_upper: FloatArray
    energy_margin: float
    object_wrench: FloatArray
    commanded_wrenches: FloatArray
    measured_wrenches: FloatArray
    base_wrenches: FloatArray
    joint_torques: FloatArray
    acceleration_error: float
    arrived: bool


class Telemetry:
    """Evaluates the ports of a closed loop.

    Args:
        loop: The closed loop.
    """

    def __init__(self, loop: ClosedLoop) -> None:
        self._loop, self._team = loop, loop.team
        inertia = self._team.object_inertia
        self._p_LLcm = inertia.p_LLcm
        self._grasps = [np.array([robot.X_LE.x, robot.X_LE.y]) for robot in self._team.robots]
        self._commanded_axes = self._team.velocity_index[:3]

    def read(self, root: Context) -> Sample:
        """Read one instant.

        Args:
            root: Context of the whole diagram.
        """
        plant_context = self._team.plant.GetMyContextFromRoot(root)
        z = self._team.plant.GetPositions(plant_context)[self._team.position_index]
        rates = self._team.plant.GetVelocities(plant_context)[self._team.velocity_index]
        planner_context = self._loop.cell_planner.GetMyContextFromRoot(root)
        cell, entry = self._loop.cell_planner.GetOutputPort("current_cell").Eval(planner_context)
        efforts = self._from_robots(root, "robot_effort")
        shares = np.array(self._from_robots(root, "wrench_share"))
        lower, upper = self._funnels(root)
        offsets = np.array([rotate(z[2], grasp) for grasp in self._grasps])
        return Sample(
            time=root.get_time(),
            cell=int(cell),
            entry=float(entry),
            z=z,
            rates=rates,
            base_poses=base_poses(self._team, plant_context),
            governor_position=self._from_robots(root, "governor_position")[0],
            funnel_lower=lower,
            funnel_upper=upper,
            energy_margin=float(min(margin[0] for margin in self._from_robots(root, "energy_margin"))),
            object_wrench=total_wrench(shares, offsets, com_offset=rotate(z[2], self._p_LLcm)),
            commanded_wrenches=shares,
            measured_wrenches=self._measured_wrenches(root, plant_context),
            base_wrenches=np.array([effort[:3] for effort in efforts]),
            joint_torques=np.concatenate([effort[3:] for effort in efforts]),
            acceleration_error=self._acceleration_error(root),
            arrived=bool(self._loop.cell_planner.GetOutputPort("arrived").Eval(planner_context)[0]),
        )

    def _from_robots(self, root: Context, output: str) -> list[FloatArray]:
        return [
            controller.GetOutputPort(output).Eval(controller.GetMyContextFromRoot(root))
            for controller in self._loop.controllers
        ]

    def _funnels(self, root: Context) -> tuple[FloatArray, FloatArray]:
        angle = self._from_robots(root, "angle_funnel")[0]
        halves = [np.split(funnels, 2) for funnels in self._from_robots(root, "joint_funnels")]
        return (
            np.concatenate([angle[:1], *(lower for lower, _ in halves)]),
            np.concatenate([angle[1:], *(upper for _, upper in halves)]),
        )

    def _acceleration_error(self, root: Context) -> float:
        station = self._loop.station.diagram
        port = station.GetOutputPort("generalized_acceleration")
        realised = port.Eval(station.GetMyContextFromRoot(root))[self._commanded_axes]
        return float(
            max(
                np.abs(realised - command).max() for command in self._from_robots(root, "object_acceleration")
            )
        )

    def _measured_wrenches(self, root: Context, plant_context: Context) -> FloatArray:
        station = self._loop.station.diagram
        reactions = station.GetOutputPort("reaction_forces").Eval(station.GetMyContextFromRoot(root))
        return np.array(
            [
                _wrench_on_object(robot, reactions[robot.weld_index], plant_context)
                for robot in self._team.robots
            ]
        )


def _wrench_on_object(robot: RobotModel, reaction: object, plant_context: Context) -> FloatArray:
    """From the reaction on the weld's child, in its frame, to the planar wrench on the object at Ek."""
    R_WJc = robot.weld.frame_on_child().CalcRotationMatrixInWorld(plant_context).matrix()
    force, torque = R_WJc @ reaction.translational(), R_WJc @ reaction.rotational()
    return -robot.weld_sign * np.array([force[0], force[1], torque[2]])
