"""Runs of a point mass behind its reference governor, with any clearance and any energy margin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.integrate import solve_ivp

from coop_drake.laws import energy_margin, governed_acceleration, governor_velocity, tracking_energy
from coop_drake.tree.arrays import FloatArray

__all__ = ["Clearance", "GovernorRun", "Margin", "box_clearance", "run_governor", "straight_field"]


Clearance = Callable[[FloatArray], float]


class Margin(Protocol):
    """A law of Delta E from the energy, the clearance and the stiffness."""

    def __call__(self, energy: float, clearance: float, stiffness: float, /) -> float:
        """Return Delta E [m^2/s^2]."""
        ...


@dataclass(frozen=True)
class GovernorRun:
    """The samples of one run.

    Attributes:
        times: Shape (T,) [s].
        position: p, shape (T, 2) [m].
        velocity: p', shape (T, 2) [m/s].
        governor: p_G, shape (T, 2) [m].
        margin: Delta E as the run has it, shape (T,) [m^2/s^2].
    """

    times: FloatArray
    position: FloatArray
    velocity: FloatArray
    governor: FloatArray
    margin: FloatArray


def box_clearance(lower: FloatArray, upper: FloatArray) -> Clearance:
    """Return the signed distance to the boundary of a box, exact inside and on the sides."""

    def clearance(point: FloatArray) -> float:
        return float(min(np.min(point - lower), np.min(upper - point)))

    return clearance


def straight_field(target: FloatArray, max_speed: float = 1.0) -> Callable[[FloatArray], FloatArray]:
    """Return a velocity field that points to the target, proportional to the distance near it."""

    def field(point: FloatArray) -> FloatArray:
        error = target - point
        return error * min(1.0, max_speed / max(float(np.hypot(*error)), 1e-300))

    return field


def run_governor(
    clearance: Clearance,
    field: Callable[[FloatArray], FloatArray],
    *,
    position: FloatArray,
    velocity: FloatArray,
    governor: FloatArray,
    gains: tuple[float, float, float, float],
    seconds: float,
    margin: Margin = energy_margin,
    tolerance: float = 1e-10,
) -> GovernorRun:
    """Integrate (14) with any clearance, field and margin.

    Args:
        clearance: Signed distance of p_G to what must not be reached [m].
        field: Velocity field, (2,) -> (2,) [m/s].
        position: p at the beginning, shape (2,) [m].
        velocity: p' there, shape (2,) [m/s].
        governor: p_G there, shape (2,) [m].
        gains: K [1/s^2], zeta [1/s], K_G [-] and c [m].
        seconds: Duration [s].
        margin: Delta E; (15) corrected unless given.
        tolerance: Relative and absolute, of the integration.
    """
    stiffness, damping, governor_gain, smoothing = gains

    def margin_of(state: FloatArray) -> float:
        (x, y), (vx, vy) = state[:2] - state[4:], state[2:4]
        energy = tracking_energy(x, y, vx, vy, stiffness)
        return margin(energy, clearance(state[4:]), stiffness)

    def derivative(_: float, state: FloatArray) -> FloatArray:
        acceleration = governed_acceleration(state[:2], state[2:4], state[4:], stiffness, damping)
        vx, vy = field(state[4:])
        rate = governor_velocity(vx, vy, margin_of(state), stiffness, governor_gain, smoothing)
        return np.concatenate([state[2:4], acceleration, rate])

    start = np.concatenate([position, velocity, governor])
    solution = solve_ivp(
        derivative, (0.0, seconds), start, method="DOP853", rtol=tolerance, atol=tolerance, max_step=0.05
    )
    states = solution.y.T
    margins = np.array([margin_of(state) for state in states])
    return GovernorRun(solution.t, states[:, :2], states[:, 2:4], states[:, 4:], margins)
