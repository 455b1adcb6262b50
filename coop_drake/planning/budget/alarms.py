"""The levels of a plan's monitors, and the room that they need: see ``laws/departure.py``."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.alarms import Alarms
from coop_drake.answers.budget import Budget
from coop_drake.answers.position_tube import PositionTube
from coop_drake.laws.departure import growth, unseen_time
from coop_drake.tree.pose import FloatArray


def position_room(budget: Budget, radius: float) -> float:
    """Return how far the object may be off its nominal position while no report tells of it [m].

    Args:
        budget: The budget.
        radius: r, how far it may be off within the budget [m].
    """
    grown = growth(budget.velocity_noise, budget.acceleration_error, _unseen(budget))
    return radius + (budget.single_noise + 1.0) * budget.position_noise + grown


def axis_reserve(budget: Budget, axes: int) -> FloatArray:
    """Return what noise and growth need beside the level of every axis (theta, q...), shape (axes,)."""
    grown = growth(budget.rate_noise, budget.axis_acceleration_error, _unseen(budget))
    return np.full(axes, budget.angle_noise + grown)


def axis_noises(budget: Budget, axes: int) -> FloatArray:
    """Return the largest errors of one robot, of the axes and of their rates, shape (2, axes).

    All robots measure the object's angle, each its own joints.
    """
    single = np.ones(axes)
    single[0] = budget.single_noise
    return np.outer([budget.angle_noise, budget.rate_noise], single)


def least_distance(budget: Budget, axes: int) -> FloatArray:
    """Return the least distance to its funnel's bounds that an axis must keep, shape (axes,) [rad or m]."""
    distance: FloatArray = axis_noises(budget, axes)[0] + axis_reserve(budget, axes)
    return distance


def alarms_of(budget: Budget, tube: PositionTube, axes: int) -> Alarms:
    """Return the levels that all transitions have in common; ``axes`` is the number of axes (theta, q...)."""
    return Alarms(
        tube.radius + budget.single_noise * budget.position_noise,
        tube.rate + budget.single_noise * budget.velocity_noise,
        axis_reserve(budget, axes) if budget.axes else np.empty(0),
        budget.grasp_noise,
        budget.turn_noise,
    )


def _unseen(budget: Budget) -> float:
    return unseen_time(budget.delay, budget.report_age, budget.period)
