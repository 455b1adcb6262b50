"""The paper's formulas as they are printed, with their errors: for the errata's tests and figure only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.tree.arrays import FloatArray

__all__ = ["angle_bounds", "axis_law", "energy_margin", "projector", "rate_term", "wrench_share"]


def energy_margin(energy: float, distance: float, stiffness: float) -> float:
    """Return Delta E as printed in (15): erratum E15a."""
    return stiffness * distance - energy


def angle_bounds(
    time: float, *, theta_l: float, theta_u: float, goal_l: float, goal_u: float, decay_rate: float
) -> tuple[float, float]:
    """Return both bounds as printed in (17), where ``theta_u`` does not occur: erratum E17a."""
    del theta_u
    decay = float(np.exp(-decay_rate * time))
    return goal_l + (theta_l - goal_l) * decay, goal_u + (theta_l - goal_u) * decay


def axis_law(
    x: float,
    rate: float,
    bounds: Sequence[float],
    *,
    log_gain: float = 1.0,
    position_gain: float = 1.0,
    rate_gain: float = 1.0,
    first_rate: float | None = None,
) -> tuple[float, float, float]:
    """Return x'' of (18), v of (19) and s, without saturation: errata E17b, E18, E20.

    Args:
        x: Position.
        rate: Its rate.
        bounds: (lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration).
        log_gain: Factor of the log term; there is none in print.
        position_gain: k1.
        rate_gain: k2.
        first_rate: What stands in the first numerator of b; rho' unless given.
    """
    lo, up, lo1, up1, lo2, up2 = bounds
    s = np.log((x - lo) / (up - x))
    a = 1.0 / (x - lo) + 1.0 / (up - x)
    b = (lo1 if first_rate is None else first_rate) / (x - lo) + up1 / (up - x)
    v = (b - position_gain * s) / a
    a_dot = -(rate - lo1) / (x - lo) ** 2 - (up1 - rate) / (up - x) ** 2
    b_dot = lo2 / (x - lo) + up2 / (up - x)
    b_dot = b_dot - lo1 * (rate - lo1) / (x - lo) ** 2 - up1 * (up1 - rate) / (up - x) ** 2
    s_dot = (rate - lo1) / (x - lo) - (up1 - rate) / (up - x)
    v_dot = (b_dot - position_gain * s_dot) / a - v * a_dot / a
    return -rate_gain * (rate - v) + v_dot - log_gain * a * s, v, s


def wrench_share(
    force: FloatArray, torque: float, com_from_contact: FloatArray, *, robots: int
) -> FloatArray:
    """Return tau_e as printed in (21) and (31), with the minus before the cross term: erratum E21."""
    turned = np.array([-com_from_contact[1], com_from_contact[0]])
    return np.array([*force, torque - force @ turned]) / robots


def projector(jacobian: FloatArray) -> FloatArray:
    """Return I - J^+ J as printed in (23): erratum E23."""
    return np.eye(jacobian.shape[1]) - np.linalg.pinv(jacobian) @ jacobian


def rate_term(jacobian_rate: FloatArray, jacobian: FloatArray, end_effector_twist: FloatArray) -> FloatArray:
    """Return J' J^+ x' as printed in (25) and (26): erratum E25."""
    term: FloatArray = jacobian_rate @ np.linalg.pinv(jacobian) @ end_effector_twist
    return term
