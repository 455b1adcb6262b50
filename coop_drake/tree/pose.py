"""Poses in the plane, in Drake's monogram notation: ``X_AB`` is the pose of frame B measured in frame A."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class PlanarPose:
    """A rigid motion of the plane.

    Attributes:
        x: First coordinate of B's origin in A [m].
        y: Second coordinate of B's origin in A [m].
        angle: Rotation from A to B, counter-clockwise [rad], not wrapped.
    """

    x: float = 0.0
    y: float = 0.0
    angle: float = 0.0

    def __matmul__(self, other: PlanarPose) -> PlanarPose:
        """Compose: ``X_AC = X_AB @ X_BC``."""
        c, s = cos(self.angle), sin(self.angle)
        return PlanarPose(
            self.x + c * other.x - s * other.y, self.y + s * other.x + c * other.y, self.angle + other.angle
        )

    def inverse(self) -> PlanarPose:
        """Return ``X_BA``."""
        c, s = cos(self.angle), sin(self.angle)
        return PlanarPose(-c * self.x - s * self.y, s * self.x - c * self.y, -self.angle)

    def apply(self, points: FloatArray) -> FloatArray:
        """Map points given in B to A; shape (..., 2) [m] to the same shape."""
        c, s = cos(self.angle), sin(self.angle)
        moved: FloatArray = points @ np.array([[c, s], [-s, c]]) + np.array([self.x, self.y])
        return moved
