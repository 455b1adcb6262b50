"""A point mass behind its reference governor, with the clearance and the margin as the caller has them."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from coop_drake.control import energy_margin, governed_acceleration, governor_velocity, tracking_energy


@dataclass(frozen=True)
class GovernorRun:
    """Samples of one run: position, velocity, governor (T, 2), times and margins (T,)."""

    times: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    governor: np.ndarray
    margin: np.ndarray


def box_clearance(lower, upper):
    """Return the signed distance to the boundary of a box, exact inside and on the sides."""

    def clearance(point):
        return float(min(np.min(point - lower), np.min(upper - point)))

    return clearance


def straight_field(target, max_speed=1.0):
    """Return a velocity field that points to the target, proportional to the distance near it."""

    def field(point):
        error = target - point
        return error * min(1.0, max_speed / max(float(np.hypot(*error)), 1e-300))

    return field


def run_governor(
    clearance, field, *, position, velocity, governor, gains, seconds, margin=energy_margin, tolerance=1e-10
):
    """Integrate (14) with any clearance, field and margin; gains are (K, zeta, K_G, c)."""
    stiffness, damping, governor_gain, smoothing = gains

    def margin_of(state):
        energy = tracking_energy(state[:2], state[2:4], state[4:], stiffness=stiffness)
        return margin(energy, clearance(state[4:]), stiffness=stiffness)

    def derivative(_, state):
        acceleration = governed_acceleration(
            state[:2], state[2:4], state[4:], stiffness=stiffness, damping=damping
        )
        rate = governor_velocity(
            field(state[4:]),
            margin_of(state),
            stiffness=stiffness,
            governor_gain=governor_gain,
            smoothing=smoothing,
        )
        return np.concatenate([state[2:4], acceleration, rate])

    start = np.concatenate([position, velocity, governor])
    solution = solve_ivp(
        derivative, (0.0, seconds), start, method="DOP853", rtol=tolerance, atol=tolerance, max_step=0.05
    )
    states = solution.y.T
    margins = np.array([margin_of(state) for state in states])
    return GovernorRun(solution.t, states[:, :2], states[:, 2:4], states[:, 4:], margins)
