"""Reads from a running closed loop all that the log contains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Context

from coop_drake.diagram.station import Loop, Places, PortRow
from coop_drake.jit import compiled
from coop_drake.laws import total_wrench
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
        alarms: What every robot's monitor of departures says, see ``DepartureMonitor``, shape (N, 3); (0, 3)
            where there is none.
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
    alarms: FloatArray
    arrived: bool


@compiled
def row_figures(
    governors: FloatArray, accelerations: FloatArray, realised: FloatArray, energy_margins: FloatArray,
    grasp_errors: FloatArray, clock_lags: FloatArray, causes: FloatArray,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Return figures of one step for the log; one that rests on NaN is NaN.

    Args:
        governors: p_G as every robot keeps it, shape (N, 2) [m].
        accelerations: Commanded accelerations of the object, shape (N, 3) [m/s^2, rad/s^2].
        realised: Accelerations of z in the plant, shape (3 + n,).
        energy_margins: Delta E of every robot, shape (N,) [m^2/s^2].
        grasp_errors: Shape (N,) [m].
        clock_lags: Lag of the funnels' clock [s], shape (1,), or (0,) where there is none.
        causes: Why the team is held, see ``HoldSupervisor``; of shape (0,) where it never is.

    Returns:
        Largest differences of copies of p_G, and of commanded to realised acceleration; smallest Delta E;
        largest error of a grasp; lag of the clock; 1 where the team is held, else 0.
    """
    spread = largest_difference(governors, governors[:1])
    difference = largest_difference(accelerations, realised[:3].copy().reshape((1, 3)))
    lag = clock_lags[0] if clock_lags.size else 0.0
    return spread, difference, energy_margins.min(), grasp_errors.max(), lag, 1.0 * causes.any()


@compiled(borrows=True)
def largest_difference(rows: FloatArray, others: FloatArray) -> float:
    """Return the largest magnitude of a component of a difference, NaN if a component is NaN.

    Args:
        rows: Shape (N, k).
        others: Rows to compare with, shape (N, k), or (1, k) to compare all with the same row.
    """
    largest = 0.0
    for i in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            difference = abs(rows[i, k] - others[i % others.shape[0], k])
            if np.isnan(difference):
                return np.nan
            largest = max(largest, difference)
    return largest


class Telemetry:
    """Evaluates the ports of a closed loop.

    Args:
        loop: The closed loop.
        root: Context of the whole diagram; every reading is of its present content.
    """

    def __init__(self, loop: Loop, root: Context) -> None:
        self._team, self._root = loop.team, root
        self._plant_context = self._team.plant.GetMyContextFromRoot(root)
        rates = self._team.plant.num_positions() + self._team.velocity_index
        self._z = len(self._team.position_index)
        self._own = np.concatenate([self._team.position_index, rates])
        self._ports = PortRow(root)
        places = [np.asarray(part, dtype=np.intp) for part in loop.places(self._ports)]
        self._order = np.concatenate([part.ravel() for part in places])
        ends = np.cumsum([part.size for part in places]).tolist()
        parts = zip(places, ends, strict=True)
        self._parts = [(slice(end - part.size, end), part.shape) for part, end in parts]
        grasps = np.array([[robot.X_LE.x, robot.X_LE.y] for robot in self._team.robots])
        self._load = grasps, self._team.object_inertia.p_LLcm

    def read(self) -> Sample:
        """Read the present instant."""
        team, row = self._team, self._ports.read()[self._order]
        at = Places(*[row[part].reshape(shape) for part, shape in self._parts])
        state = team.plant.GetPositionsAndVelocities(self._plant_context)[self._own]
        z, errors = state[: self._z], team.grasps.errors(self._plant_context)
        spread, difference, margin, error, lag, held = row_figures(
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
            object_wrench=total_wrench(at.commanded_wrenches, *self._load, float(z[2])),
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
            alarms=at.alarms,
            arrived=bool(arrived),
        )
