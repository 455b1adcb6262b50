"""Animations of few frames: between those kept, linear interpolation meets all within a tolerance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import MeshcatAnimation
from pydrake.math import RigidTransform, RotationMatrix

from coop_drake.tree.pose import FloatArray

_POSITION, _ANGLE, _SCALE = 3e-3, 5e-3, 0.03
"""Largest errors of positions [m], angles [rad] and scales [-]: a pixel or so."""


def kept_frames(values: FloatArray, tolerance: float, *, longest: int) -> list[int]:
    """Return the frames to keep so that linear interpolation between them meets all others.

    Args:
        values: Of every frame, shape (F, k).
        tolerance: Largest error of any component.
        longest: Largest number of frames from one kept frame to the next.
    """
    last = len(values) - 1
    kept = {*range(0, last + 1, longest), last}
    stretches = list(zip(sorted(kept), sorted(kept)[1:], strict=False))
    while stretches:
        first, end = stretches.pop()
        fraction = (np.arange(first + 1, end) - first)[:, None] / (end - first)
        errors = np.abs(values[first] + fraction * (values[end] - values[first]) - values[first + 1 : end])
        if errors.size and errors.max() > tolerance:
            middle = first + 1 + int(errors.max(axis=1).argmax())
            kept.add(middle)
            stretches += [(first, middle), (middle, end)]
    return sorted(kept)


class Tracks:
    """Tracks of an animation; every track lasts from the first to the last frame.

    Args:
        frames_per_second: Of the values that the methods receive [1/s].
    """

    def __init__(self, frames_per_second: float) -> None:
        self.animation = MeshcatAnimation(frames_per_second)
        self._longest = max(1, round(frames_per_second))

    def move(
        self,
        path: str,
        positions: FloatArray,
        angles: FloatArray,
        R_0: RotationMatrix | None = None,
        *,
        angle_tolerance: float = _ANGLE,
    ) -> None:
        """Move and turn an object.

        Args:
            path: The object.
            positions: In the frame of its parent, shape (F, 3) [m].
            angles: About the vertical, unwrapped, shape (F,) [rad].
            R_0: Its orientation at angle zero.
            angle_tolerance: Largest error of the angle [rad].
        """
        R_0 = RotationMatrix() if R_0 is None else R_0
        # A kept frame at least every second: between two of them Meshcat turns the shorter way round.
        weighted = np.column_stack([positions, angles * (_POSITION / angle_tolerance)])
        for frame in kept_frames(weighted, _POSITION, longest=self._longest):
            turn = RotationMatrix.MakeZRotation(angles[frame])
            self.animation.SetTransform(frame, path, RigidTransform(turn @ R_0, positions[frame]))

    def vary(self, path: str, name: str, values: FloatArray) -> None:
        """Change a property of three components, with values of shape (F, 3)."""
        for frame in kept_frames(values, _SCALE, longest=len(values)):
            self.animation.SetProperty(frame, path, name, values[frame].tolist())

    def count(self, path: str, name: str, values: FloatArray) -> None:
        """Change a property that counts, with values of shape (F,), to within one."""
        for frame in kept_frames(values[:, None], 1.0, longest=len(values)):
            self.animation.SetProperty(frame, path, name, float(values[frame]))

    def show(self, path: str, visible: NDArray[np.bool_]) -> None:
        """Show and hide an object; ``visible`` of shape (F,)."""
        changes = np.flatnonzero(np.diff(visible)) + 1
        for frame in sorted({0, *changes.tolist(), len(visible) - 1}):
            self.animation.SetProperty(frame, path, "visible", bool(visible[frame]))
