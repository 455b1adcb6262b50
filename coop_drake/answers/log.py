"""The log of a run: named numpy arrays, one row for each accepted step, and the file that holds them."""

from __future__ import annotations

import zipfile
import zlib
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from coop_drake.errors import PlanError
from coop_drake.files import check_readable, write_atomically
from coop_drake.tree.arrays import FloatArray, IntArray

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


def _row(unit: str, *shape: str | int, optional: bool = False) -> dict[str, Any]:
    """Describe a column by its unit, the shape of a row, and whether logs may lack it."""
    return {"unit": unit, "shape": ("T", *shape), "kind": "fi", "optional": optional}


def _text(*shape: str) -> dict[str, Any]:
    """Describe a text, or a row of them, which a log has once."""
    return {"shape": shape, "kind": "U"}


@dataclass(frozen=True)
class SimulationLog:
    """One run; row t of every array belongs to ``times[t]``, an accepted integration step.

    This is the table of columns: of their names, units, shapes and meanings. N robots, n joints of the whole
    team in the plan's order; the 1 + n axes of funnels and slices are (theta, q...). Planar quantities are
    ordered (x, y, rotation) in W. Margins are positive where the invariant holds. Where a column comes from,
    ``simulation/telemetry.py`` says, also of the margins.
    """

    times: FloatArray = field(metadata=_row("s"))
    """Simulated time."""
    cell_index: IntArray = field(metadata=_row("-"))
    """Index of the current cell."""
    transition_start: FloatArray = field(metadata=_row("s"))
    """Time at which the current cell was entered."""
    object_pose: FloatArray = field(metadata=_row("m, rad", 3))
    """Pose of L in W, theta unwrapped."""
    object_twist: FloatArray = field(metadata=_row("m/s, rad/s", 3))
    """Velocity of L's origin and its angular rate."""
    base_poses: FloatArray = field(metadata=_row("m, rad", "N", 3))
    """Pose of every robot's base frame Bk in W."""
    joints: FloatArray = field(metadata=_row("rad or m", "n"))
    """Every joint."""
    joint_rates: FloatArray = field(metadata=_row("rad/s or m/s", "n"))
    """Their rates."""
    accelerations: FloatArray = field(metadata=_row("m/s^2, rad/s^2", "3 + n"))
    """Accelerations of the object's pose and of every joint in the plant."""
    governor_position: FloatArray = field(metadata=_row("m", 2))
    """p_G as robot 0 keeps it."""
    governor_spread: FloatArray = field(metadata=_row("m"))
    """Largest difference of a coordinate of p_G between robots."""
    funnel_lower: FloatArray = field(metadata=_row("rad or m", "1 + n"))
    """Lower funnel bound of every axis."""
    funnel_upper: FloatArray = field(metadata=_row("rad or m", "1 + n"))
    """Upper funnel bound of every axis."""
    energy_margin: FloatArray = field(metadata=_row("m^2/s^2"))
    """Delta E of (15), smallest over the robots' copies."""
    object_wrench: FloatArray = field(metadata=_row("N, N m", 3))
    """Total wrench commanded to the object at its centre of mass."""
    commanded_wrenches: FloatArray = field(metadata=_row("N, N m", "N", 3))
    """Share (31) of every robot at its grasp."""
    measured_wrenches: FloatArray = field(metadata=_row("N, N m", "N", 3))
    """Wrench that the grasp weld transmits to the object there."""
    grasp_error: FloatArray = field(metadata=_row("m"))
    """Largest distance between a robot's end effector Ek and its grasp on the object."""
    base_wrenches: FloatArray = field(metadata=_row("N, N m", "N", 3))
    """Actuation of every base at Bk."""
    joint_torques: FloatArray = field(metadata=_row("N m or N", "n"))
    """Actuation of every joint."""
    ready_margins: FloatArray = field(metadata=_row("-", "N"))
    """Margin that every robot reports; ready where not negative."""
    held: FloatArray = field(metadata=_row("-"))
    """1 where the team is held at rest inside its cell, else 0."""
    clock_lag: FloatArray = field(metadata=_row("s"))
    """By how much the funnels' clock lags behind the time since the cell was entered."""
    workspace_clearance: FloatArray = field(metadata=_row("m"))
    """Smallest distance of any body to any wall."""
    body_clearance: FloatArray = field(metadata=_row("m"))
    """Smallest distance between bodies that must not touch."""
    cell_clearance: FloatArray = field(metadata=_row("m"))
    """Signed distance of p_WL to the boundary of the cell's governed set."""
    funnel_margin: FloatArray = field(metadata=_row("rad or m"))
    """Smallest distance of an axis to its funnel's bounds."""
    slice_margin: FloatArray = field(metadata=_row("rad or m"))
    """Smallest distance of an axis to its slice's bounds."""
    acceleration_error: FloatArray = field(metadata=_row("m/s^2 or rad/s^2"))
    """Largest component of realised minus desired acceleration of the object, over all robots' copies of the
    command."""
    wrench_error: FloatArray = field(metadata=_row("N or N m"))
    """Largest component of measured minus commanded wrench."""
    reached: bool = field(metadata={"shape": (), "kind": "b"})
    """Whether the object came to rest at the goal."""
    violation: str = field(metadata=_text())
    """Which invariant broke, when and by how much; empty if none did."""
    joint_names: tuple[str, ...] = field(metadata=_text("n"))
    """Names of the joints' columns."""
    robot_names: tuple[str, ...] = field(metadata=_text("N"))
    """Names of the robots' rows."""
    plan_digest: str = field(default="", metadata=_text())
    """``plan_digest`` of the plan that was followed."""
    scenario_digest: str = field(default="", metadata=_text())
    """``scenario_digest`` of the scenario that was simulated."""
    phases: FloatArray = field(
        default_factory=lambda: np.empty((0, 0, 3)), metadata=_row("s, -, 1/s", "N", 3, optional=True)
    )
    """Phase on the plan's motion by every robot's clock, pace and its rate; only where the plan has one."""

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
        for name in _optional():
            if not arrays[name].size:
                del arrays[name]
        write_atomically(path, lambda stream: np.savez_compressed(stream, **arrays))

    @classmethod
    def load(cls, path: Path | str) -> SimulationLog:
        """Read a log written by ``save``.

        Args:
            path: The ``.npz`` file.

        Raises:
            PlanError: The file is no log, or an array in it is missing or damaged, or of another shape or
                kind than the others make it; the message names it.
        """
        path, names = Path(path), [f.name for f in fields(cls)]
        try:
            with (
                check_readable(path, _LARGEST).open("rb") as stream,
                np.load(stream, allow_pickle=False) as archive,
            ):
                names = [name for name in names if name in archive or name not in _optional()]
                if missing := [name for name in names if name not in archive]:
                    raise PlanError(
                        f"{path}: not a simulation log; it lacks {', '.join(missing)}; expected what a run "
                        "wrote"
                    )
                values: dict[str, Any] = {name: _array(path, archive, name) for name in names}
        except (*_DAMAGE, AttributeError) as error:  # AttributeError: a single array is no archive
            raise PlanError(f"{path}: cannot be read: {error}; expected the .npz file of a run") from error
        _check(path, values)
        for one in fields(cls):
            if one.name not in values:
                continue
            kind, shape = one.metadata["kind"], one.metadata["shape"]
            if kind == "U":
                values[one.name] = tuple(map(str, values[one.name])) if shape else str(values[one.name])
        return cls(**{**values, "reached": bool(values["reached"])})


def _optional() -> list[str]:
    return [one.name for one in fields(SimulationLog) if one.metadata.get("optional")]


def _array(path: Path, archive: Any, name: str) -> np.ndarray[Any, Any]:
    try:
        array = archive[name]
    except _DAMAGE as error:
        raise PlanError(f"{path}: {name}: is damaged: {error}; expected an array") from error
    if not isinstance(array, np.ndarray):
        raise PlanError(f"{path}: {name}: is no array; expected one")
    return array


def _check(path: Path, arrays: dict[str, np.ndarray[Any, Any]]) -> None:
    """Refuse arrays that do not have the shapes and kinds of the table."""
    sizes: dict[str, int] = {}
    for one in fields(SimulationLog):
        if one.name not in arrays:
            continue
        array, shape, kind = arrays[one.name], one.metadata["shape"], one.metadata["kind"]
        # To numpy an empty list of names is one of numbers.
        if array.size and array.dtype.kind not in kind:
            wanted = {"b": "a truth", "U": "texts"}.get(kind, "numbers")
            raise PlanError(f"{path}: {one.name}: has entries of kind {array.dtype}; expected {wanted}")
        fits = array.ndim == len(shape) and all(
            sizes.setdefault(size, length) == length if isinstance(size, str) else size == length
            for size, length in zip(shape, array.shape, strict=True)
        )
        if not fits:
            wanted = ", ".join(f"{size} = {sizes[size]}" if size in sizes else str(size) for size in shape)
            raise PlanError(f"{path}: {one.name}: has the shape {array.shape}; expected ({wanted})")
