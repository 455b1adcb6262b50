"""The paper's formulas as they are printed, for the tests that show why they are not used."""

import numpy as np


def energy_margin(energy, distance, *, stiffness):
    """Return Delta E as printed in (15)."""
    return stiffness * distance - energy


def angle_walls(time, *, theta_l, theta_u, goal_l, goal_u, decay_rate):
    """Return both walls as printed in (17)."""
    decay = np.exp(-decay_rate * time)
    return goal_l + (theta_l - goal_l) * decay, goal_u + (theta_l - goal_u) * decay


def axis_law(x, rate, walls, *, log_gain=1.0, position_gain=1.0, rate_gain=1.0, first_rate=None):
    """Return x'' of (18), v of (19) and s, without saturation; walls hold rho and its two derivatives.

    Args:
        x: Position.
        rate: Its rate.
        walls: (lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration).
        log_gain: Factor of the log term; there is none in print.
        position_gain: k1.
        rate_gain: k2.
        first_rate: What stands in the first numerator of b; rho' unless given.
    """
    lo, up, lo1, up1, lo2, up2 = walls
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


def wrench_share(force, torque, com_from_contact, *, robots):
    """Return tau_e as printed in (21) and (31), with the minus sign before the cross term."""
    turned = np.array([-com_from_contact[1], com_from_contact[0]])
    return np.array([*force, torque - force @ turned]) / robots


def projector(jacobian):
    """Return I - J^+ J as printed in (23)."""
    return np.eye(jacobian.shape[1]) - np.linalg.pinv(jacobian) @ jacobian


def rate_term(jacobian_rate, jacobian, end_effector_twist):
    """Return J' J^+ x' as printed in (25) and (26)."""
    return jacobian_rate @ np.linalg.pinv(jacobian) @ end_effector_twist
