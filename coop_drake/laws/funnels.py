"""Funnels: walls that shrink a slice to its goal interval, equations (17) and (39)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.laws import kernels
from coop_drake.laws.gains import FloatArray, FunnelShape


@dataclass(frozen=True)
class Funnel:
    """The funnels of one transition, one per axis.

    Attributes:
        slice_lower: Lower walls at time 0, shape (m,) [rad or m].
        slice_upper: Upper walls at time 0, shape (m,).
        goal_lower: Lower walls in the limit, shape (m,).
        goal_upper: Upper walls in the limit, shape (m,).
        decay_rate: lambda, shape (m,) [1/s].
        shape: ``exponential``, e^(-lambda t) as printed, or ``smooth``, (1 + lambda t) e^(-lambda t).
    """

    slice_lower: FloatArray
    slice_upper: FloatArray
    goal_lower: FloatArray
    goal_upper: FloatArray
    decay_rate: FloatArray
    shape: FunnelShape = "smooth"

    @property
    def kernel_arguments(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, bool]:
        """What the compiled kernels take, in their order."""
        return (
            self.slice_lower,
            self.slice_upper,
            self.goal_lower,
            self.goal_upper,
            self.decay_rate,
            self.shape == "smooth",
        )

    def select(self, axes: NDArray[np.intp]) -> Funnel:
        """Return the funnels of some axes only, for instance those that one robot controls."""
        return replace(
            self,
            slice_lower=self.slice_lower[axes],
            slice_upper=self.slice_upper[axes],
            goal_lower=self.goal_lower[axes],
            goal_upper=self.goal_upper[axes],
            decay_rate=self.decay_rate[axes],
        )


class FunnelWalls(NamedTuple):
    """Walls of m axes at one instant, each entry of shape (m,), in rad or m and seconds."""

    lower: FloatArray
    upper: FloatArray
    lower_rate: FloatArray
    upper_rate: FloatArray
    lower_acceleration: FloatArray
    upper_acceleration: FloatArray


def funnel_walls(funnel: Funnel, time: float) -> FunnelWalls:
    """Return the walls ``time`` after the transition began, with their derivatives.

    rho(t) = rho_G + (rho_0 - rho_G) f(t) for the lower and the upper wall, each from its own end of the
    slice: (17) and (39), errata E17a and E39.

    Args:
        funnel: Funnels of m axes.
        time: t >= 0 since the transition began [s].

    Returns:
        Walls of every axis.
    """
    return FunnelWalls(*kernels.funnel_walls(float(time), *funnel.kernel_arguments))
