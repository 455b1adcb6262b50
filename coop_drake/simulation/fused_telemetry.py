"""Reads from a fused loop everything that the log keeps."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context

from coop_drake.diagram import ClosedLoop
from coop_drake.simulation.step_kernels import largest_difference, object_wrench
from coop_drake.simulation.telemetry import Sample, port_reader

__all__ = ["FusedTelemetry"]


class FusedTelemetry:
    """Asks the one block that drives the team what the robots' own blocks would tell.

    Args:
        loop: A closed loop of fused blocks.
        root: Context of the whole diagram; every reading is of its present content.

    Raises:
        ValueError: The loop's blocks are not fused.
    """

    def __init__(self, loop: ClosedLoop, root: Context) -> None:
        if loop.fused is None:
            raise ValueError("FusedTelemetry needs a loop of fused blocks")
        fused, team, station = loop.fused, loop.team, loop.station.diagram
        self._team, self._root, self._driver = team, root, fused.driver
        self._plant_context = team.plant.GetMyContextFromRoot(root)
        self._driver_context = fused.driver.GetMyContextFromRoot(root)
        self._grasps = np.array([[robot.X_LE.x, robot.X_LE.y] for robot in team.robots])
        self._axes = 1 + len(team.joints)
        self._rates = team.plant.num_positions() + team.velocity_index
        self._governor = port_reader(fused.governor, fused.governor.get_output_port().get_name(), root)
        self._ready = port_reader(fused.driver, "ready", root)
        self._current_cell = port_reader(loop.cell_planner, "current_cell", root)
        self._arrived = port_reader(loop.cell_planner, "arrived", root)
        self._accelerations = port_reader(station, "generalized_acceleration", root)
        self._held = [port_reader(port.get_system(), port.get_name(), root) for port in fused.efforts]

    def read(self) -> Sample:
        """Read the present instant."""
        team, state = self._team, self._team.plant.GetPositionsAndVelocities(self._plant_context)
        z, robots = state[team.position_index], len(self._grasps)
        cell, entry = self._current_cell()
        report = self._driver.report(self._driver_context)
        bases, torques = report.efforts[: 3 * robots].reshape(robots, 3), report.efforts[3 * robots :]
        if self._held:
            held = [read() for read in self._held]
            bases = np.array([effort[:3] for effort in held])
            torques = np.concatenate([effort[3:] for effort in held])
        commanded = np.ascontiguousarray(report.hands[:, 3:])
        realised = self._accelerations()[team.velocity_index[:3]]
        return Sample(
            time=self._root.get_time(),
            cell=int(cell),
            entry=float(entry),
            z=z,
            rates=state[self._rates],
            base_poses=report.bases,
            governor_position=self._governor(),
            governor_spread=0.0,
            funnel_lower=report.walls[: self._axes],
            funnel_upper=report.walls[self._axes :],
            energy_margin=report.energy_margin,
            object_wrench=object_wrench(commanded, self._grasps, team.object_inertia.p_LLcm, z[2]),
            commanded_wrenches=commanded,
            measured_wrenches=team.grasps.wrenches(self._plant_context, bases),
            grasp_error=float(team.grasps.errors(self._plant_context).max()),
            base_wrenches=bases,
            joint_torques=torques,
            acceleration_error=largest_difference(report.acceleration[None], realised[None]),
            ready_margins=self._ready()[1::2],
            arrived=bool(self._arrived()[0]),
        )
