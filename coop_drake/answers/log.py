"""The log of a run: named numpy arrays, one row for each accepted step."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from coop_drake.answers.log_reader import read_arrays
from coop_drake.files import write_atomically
from coop_drake.tree.pose import FloatArray, IntArray


@dataclass(frozen=True)
class SimulationLog:
    """One run; row t of every array belongs to ``times[t]``, an accepted integration step.

    N robots, n joints of the whole team in the plan's order; axes of funnels and slices are (theta, q...).
    Planar quantities are ordered (x, y, rotation) in W. Margins are positive where the invariant holds.

    Attributes:
        times: Simulated time, shape (T,) [s].
        cell_index: Index of the current cell, shape (T,).
        transition_start: Time at which the current cell was entered, shape (T,) [s].
        object_pose: Pose of L in W, theta unwrapped, shape (T, 3) [m, rad].
        object_twist: Velocity of L's origin and its angular rate, shape (T, 3) [m/s, rad/s].
        base_poses: Pose of every robot's base frame Bk in W, shape (T, N, 3) [m, rad].
        joints: Every joint, shape (T, n) [rad or m].
        joint_rates: Their rates, shape (T, n) [rad/s or m/s].
        accelerations: Accelerations of the object's pose and of every joint in the plant, shape (T, 3 + n)
            [m/s^2, rad/s^2].
        governor_position: p_G as robot 0 keeps it, shape (T, 2) [m].
        governor_spread: Largest difference of a coordinate of p_G between robots, shape (T,) [m].
        funnel_lower: Lower funnel bound per axis, shape (T, 1 + n) [rad or m].
        funnel_upper: Upper funnel bound per axis, shape (T, 1 + n) [rad or m].
        energy_margin: Delta E of (15), smallest over the robots' copies, shape (T,) [m^2/s^2].
        object_wrench: Total wrench commanded to the object at its centre of mass, shape (T, 3) [N, N m].
        commanded_wrenches: Share (31) of every robot at its grasp, shape (T, N, 3) [N, N m].
        measured_wrenches: Wrench that the grasp weld transmits to the object there, shape (T, N, 3) [N, N m].
        grasp_error: Largest distance between a robot's end effector Ek and its grasp on the object, shape
            (T,) [m].
        base_wrenches: Actuation of every base at Bk, shape (T, N, 3) [N, N m].
        joint_torques: Actuation of every joint, shape (T, n) [N m or N].
        ready_margins: Margin that every robot reports; ready where not negative, shape (T, N) [-].
        held: 1 where the team is held at rest inside its cell, else 0, shape (T,) [-].
        clock_lag: By how much the funnels' clock lags behind the time since the cell was entered, shape
            (T,) [s].
        workspace_clearance: Smallest distance of any body to any wall, shape (T,) [m].
        body_clearance: Smallest distance between bodies that must not touch, shape (T,) [m].
        cell_clearance: Signed distance of p_WL to the boundary of the cell's governed set, shape (T,) [m].
        funnel_margin: Smallest distance of an axis to its funnel's bounds, shape (T,) [rad or m].
        slice_margin: Smallest distance of an axis to its slice's bounds, shape (T,) [rad or m].
        acceleration_error: Largest component of realised minus desired acceleration of the object,
            over all robots' copies of the command, shape (T,) [m/s^2 or rad/s^2].
        wrench_error: Largest component of measured minus commanded wrench, shape (T,) [N or N m].
        reached: Whether the object came to rest at the goal.
        violation: Which invariant broke, when and by how much; empty if none did.
        joint_names: Names of the joints' columns.
        robot_names: Names of the robots' rows.
        plan_digest: ``plan_digest`` of the plan that was followed.
        scenario_digest: ``scenario_digest`` of the scenario that was simulated.
    """

    times: FloatArray
    cell_index: IntArray
    transition_start: FloatArray
    object_pose: FloatArray
    object_twist: FloatArray
    base_poses: FloatArray
    joints: FloatArray
    joint_rates: FloatArray
    accelerations: FloatArray
    governor_position: FloatArray
    governor_spread: FloatArray
    funnel_lower: FloatArray
    funnel_upper: FloatArray
    energy_margin: FloatArray
    object_wrench: FloatArray
    commanded_wrenches: FloatArray
    measured_wrenches: FloatArray
    grasp_error: FloatArray
    base_wrenches: FloatArray
    joint_torques: FloatArray
    ready_margins: FloatArray
    held: FloatArray
    clock_lag: FloatArray
    workspace_clearance: FloatArray
    body_clearance: FloatArray
    cell_clearance: FloatArray
    funnel_margin: FloatArray
    slice_margin: FloatArray
    acceleration_error: FloatArray
    wrench_error: FloatArray
    reached: bool
    violation: str
    joint_names: tuple[str, ...]
    robot_names: tuple[str, ...]
    plan_digest: str = ""
    scenario_digest: str = ""

    @property
    def peak_force_rate(self) -> float:
        """Largest change of a base's force over an accepted step, over the step's length [N/s].

        In a sampled team forces step; there it is the largest step over the time between samples.
        """
        lengths = np.diff(self.times)
        changes = np.hypot(*np.moveaxis(np.diff(self.base_wrenches[..., :2], axis=0), -1, 0)).max(axis=1)
        moved = lengths > 0.0
        return float((changes[moved] / lengths[moved]).max(initial=0.0))

    def save(self, path: Path | str) -> None:
        """Write the log as a compressed ``.npz`` file; an interrupted write leaves no file behind.

        Args:
            path: Where to write; an existing file is replaced.
        """
        arrays: dict[str, Any] = {f.name: np.asarray(getattr(self, f.name)) for f in fields(self)}
        write_atomically(path, lambda stream: np.savez_compressed(stream, **arrays))

    @classmethod
    def load(cls, path: Path | str) -> SimulationLog:
        """Read a log written by ``save``.

        Args:
            path: The ``.npz`` file.

        Raises:
            PlanError: The file is no log, or an array in it is missing, damaged or misshapen; names it.
        """
        values: dict[str, Any] = read_arrays(Path(path), [f.name for f in fields(cls)])
        return cls(
            **{
                **values,
                "reached": bool(values["reached"]),
                **{name: str(values[name]) for name in ("violation", "plan_digest", "scenario_digest")},
                "joint_names": tuple(str(name) for name in values["joint_names"]),
                "robot_names": tuple(str(name) for name in values["robot_names"]),
            }
        )
