"""Reads the arrays of a log file and checks that they are complete and have consistent shapes."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from coop_drake.errors import PlanError
from coop_drake.files import check_readable

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
