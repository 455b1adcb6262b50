"""The log of a run: named numpy arrays, one row for each accepted step."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from coop_drake.errors import PlanError
from coop_drake.files import check_readable, write_atomically
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


# Reads the arrays of a log file and checks that they are complete and have consistent shapes.

_DAMAGE = (
    OSError,
    ValueError,
    KeyError,
    TypeError,
    EOFError,
    NotImplementedError,
    zipfile.BadZipFile,
    zlib.error,
)
_LARGEST = 4000.0
"""Largest log [MB]; a minute of transport has about ten."""
_TIMES = ("T",)
_SHAPES: dict[str, tuple[str | int, ...]] = {
    "object_pose": ("T", 3),
    "object_twist": ("T", 3),
    "base_poses": ("T", "N", 3),
    "joints": ("T", "n"),
    "joint_rates": ("T", "n"),
    "accelerations": ("T", "coordinates"),
    "governor_position": ("T", 2),
    "funnel_lower": ("T", "axes"),
    "funnel_upper": ("T", "axes"),
    "object_wrench": ("T", 3),
    "commanded_wrenches": ("T", "N", 3),
    "measured_wrenches": ("T", "N", 3),
    "base_wrenches": ("T", "N", 3),
    "joint_torques": ("T", "n"),
    "ready_margins": ("T", "N"),
    "reached": (),
    "violation": (),
    "plan_digest": (),
    "scenario_digest": (),
    "joint_names": ("n",),
    "robot_names": ("N",),
}
"""Shapes of the arrays as in the docstring of the log; every other array has shape (T,)."""
_TEXTS = ("violation", "joint_names", "robot_names", "plan_digest", "scenario_digest")
_KINDS = {"reached": "b", **dict.fromkeys(_TEXTS, "U")}
"""Kinds of the arrays that do not hold numbers, as numpy names them."""


def read_arrays(path: Path, names: Sequence[str]) -> dict[str, np.ndarray[Any, Any]]:
    """Read the arrays of a log.

    Args:
        path: The file.
        names: Which arrays it must have.

    Raises:
        PlanError: The file is no archive, or an array in it is missing or damaged, or of another shape or
            kind than the others make it; the message names it.
    """
    try:
        with (
            check_readable(path, _LARGEST).open("rb") as stream,
            np.load(stream, allow_pickle=False) as archive,
        ):
            missing = [name for name in names if name not in archive]
            if missing:
                raise PlanError(
                    f"{path}: not a simulation log; it lacks {', '.join(missing)}; expected what a run wrote"
                )
            return _checked(path, {name: _array(path, archive, name) for name in names})
    except (*_DAMAGE, AttributeError) as error:  # AttributeError: a single array is no archive
        raise PlanError(f"{path}: cannot be read: {error}; expected the .npz file of a run") from error


def _array(path: Path, archive: Any, name: str) -> np.ndarray[Any, Any]:
    try:
        array = archive[name]
    except _DAMAGE as error:
        raise PlanError(f"{path}: {name}: is damaged: {error}; expected an array") from error
    if not isinstance(array, np.ndarray):
        raise PlanError(f"{path}: {name}: is no array; expected one")
    return array


def _checked(path: Path, arrays: dict[str, np.ndarray[Any, Any]]) -> dict[str, np.ndarray[Any, Any]]:
    sizes: dict[str, int] = {}
    for name, array in arrays.items():
        shape = _SHAPES.get(name, _TIMES)
        # To numpy an empty list of names is one of numbers.
        if array.size and array.dtype.kind not in _KINDS.get(name, "fi"):
            raise PlanError(f"{path}: {name}: has entries of kind {array.dtype}; expected {_kind(name)}")
        fits = array.ndim == len(shape) and all(
            sizes.setdefault(size, length) == length if isinstance(size, str) else size == length
            for size, length in zip(shape, array.shape, strict=True)
        )
        if not fits:
            wanted = ", ".join(f"{size} = {sizes[size]}" if size in sizes else str(size) for size in shape)
            raise PlanError(f"{path}: {name}: has the shape {array.shape}; expected ({wanted})")
    return arrays


def _kind(name: str) -> str:
    return {"b": "a truth"}.get(_KINDS.get(name, ""), "texts" if name in _KINDS else "numbers")
