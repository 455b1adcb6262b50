"""What a hand-over to the next cell must certify, computed apart from the laws that judge it."""

from __future__ import annotations

import numpy as np
from shapely import Point

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan


def assert_certified(plan: Plan, log: SimulationLog) -> None:
    """Whenever a run's cell planner went on, both energies of the next cell were within their bounds."""
    rows = np.flatnonzero(np.diff(log.cell_index))
    assert len(rows) == len(plan.cells) - 1
    for row in rows:
        index, pose, twist = int(log.cell_index[row]), log.object_pose[row], log.object_twist[row]
        assert energy_surplus(plan, index, pose[:2], twist[:2], log.governor_position[row]) >= -1e-12
        axes = np.concatenate([pose[2:], log.joints[row]])
        rates = np.concatenate([twist[2:], log.joint_rates[row]])
        assert funnel_surpluses(plan, index, axes, rates).min() >= -1e-12


def energy_surplus(
    plan: Plan, index: int, position: np.ndarray, velocity: np.ndarray, governor: np.ndarray
) -> float:
    """Delta E of the next cell, less what holds the object within half the goal's inradius.

    K is that with which the next cell is entered: the old cell's where the hand-over takes time.

    Args:
        plan: The plan.
        index: The cell that is left.
        position: p (2,) [m].
        velocity: p' (2,) [m/s].
        governor: p_G (2,) [m].
    """
    cell, gains = plan.cells[index + 1].tidied, plan.transitions[index + 1].gains
    stiffness = (plan.transitions[index].gains if gains.hand_over_time > 0.0 else gains).stiffness
    distance = cell.exterior.distance(Point(governor)) if cell.contains(Point(governor)) else 0.0
    energy = 0.5 * velocity @ velocity + 0.5 * stiffness * (position - governor) @ (position - governor)
    kept = 0.5 * plan.transitions[index].inradius
    return float(0.5 * stiffness * distance**2 - energy - 0.5 * stiffness * kept**2)


def funnel_surpluses(plan: Plan, index: int, axes: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """By how much V of every axis in the next funnel, with its gains, stays below the plan's bound, (1 + n,).

    Args:
        plan: The plan.
        index: The cell that is left.
        axes: (theta, q...), (1 + n,).
        rates: Their rates (1 + n,).
    """
    cell, transition = plan.cells[index + 1], plan.transitions[index + 1]
    gains = transition.gains
    below, above = axes - cell.lower, cell.upper - axes
    assert min(below.min(), above.min()) > 0.0
    s = np.log(below / above)
    # Walls of the quintic funnel rest at its mouth; those of the printed one move at their fastest.
    speed = gains.decay_rate if gains.funnel == "exponential" else np.zeros_like(axes)
    lower_rate, upper_rate = (
        speed * (transition.goal_lower - cell.lower),
        speed * (transition.goal_upper - cell.upper),
    )
    inverse = 1.0 / below + 1.0 / above
    pull = 0.0 if gains.ramp_rate > 0.0 else gains.position_gain  # a ramp of k1 begins at zero
    wanted = (lower_rate / below + upper_rate / above - pull * s) / inverse
    return gains.energy_bound - 0.5 * gains.log_gain * s**2 - 0.5 * (rates - wanted) ** 2
