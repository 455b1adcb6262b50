"""The levels of a plan's monitors, and the room that they need: see ``laws/readiness.py``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coop_drake.answers.budget import Alarms, AxisTracking, Budget, PositionTube
from coop_drake.laws.readiness import growth, unseen_time
from coop_drake.tree.pose import FloatArray


def rubbed(budget: Budget, tracking: AxisTracking | None) -> Budget:
    """Return the budget of the object's origin: its ``acceleration_error`` counts the friction of joints."""
    if tracking is None or not tracking.disturbance:
        return budget
    pushed = budget.acceleration_error + tracking.disturbance[0]
    return replace(budget, acceleration_error=pushed, axis_error=budget.axis_acceleration_error)


def axis_errors(budget: Budget, tracking: AxisTracking, axes: int) -> FloatArray:
    """Return the largest accelerations of axes beside those of the model's error, shape (axes,)."""
    errors = np.full(axes, budget.axis_acceleration_error)
    return errors + tracking.disturbance[1:] if tracking.disturbance else errors


def position_room(budget: Budget, tube: PositionTube) -> float:
    """Return how far the object may be off its nominal position while no report tells of it [m].

    Where it is now is one end of the straight way that its rate shows, and its end the other one.

    Args:
        budget: The budget, see ``rubbed``.
        tube: The tube of the object's position.
    """
    unseen, mistaken_rate = unseen_of(budget), _mistaken_rate(budget, tube)
    here = _position_level(budget, tube) + budget.position_noise
    there = _level_ahead(budget, tube) + budget.position_noise + unseen * budget.velocity_noise
    wrong = budget.age_error * tube.velocity + unseen * mistaken_rate
    return max(here, there) + wrong + 0.5 * budget.acceleration_error * unseen**2


def mistaken(budget: Budget, tracking: AxisTracking, axes: int) -> FloatArray:
    """Return by how much axes and their rates are measured wrongly as ages are wrong, shape (2, axes)."""
    if not budget.age_error or not tracking.rate:
        return np.zeros((2, axes))
    return budget.age_error * np.array([tracking.rate, tracking.acceleration])


def axis_reserve(budget: Budget, tracking: AxisTracking, axes: int) -> FloatArray:
    """Return what noise and growth need beside the level of every axis (theta, q...), shape (axes,)."""
    errors, time = axis_errors(budget, tracking, axes), unseen_of(budget)
    grown = np.array([growth(budget.rate_noise, error, time) for error in errors.tolist()])
    reserve: FloatArray = budget.angle_noise + grown + mistaken(budget, tracking, axes)[0]
    return reserve


def axis_noises(budget: Budget, tracking: AxisTracking, axes: int) -> FloatArray:
    """Return the largest errors of one robot, of the axes and of their rates, shape (2, axes).

    All robots measure the object's angle, each its own joints.
    """
    single = np.ones(axes)
    single[0] = budget.single_noise
    noises: FloatArray = np.outer([budget.angle_noise, budget.rate_noise], single)
    return noises + mistaken(budget, tracking, axes)


def least_distance(budget: Budget, tracking: AxisTracking, axes: int) -> FloatArray:
    """Return the least distance to its funnel's bounds that an axis must keep, shape (axes,) [rad or m]."""
    distance: FloatArray = axis_noises(budget, tracking, axes)[0] + axis_reserve(budget, tracking, axes)
    return distance


def alarms_of(budget: Budget, tube: PositionTube, tracking: AxisTracking | None, axes: int) -> Alarms:
    """Return the levels that all transitions have in common.

    Args:
        budget: The budget, see ``rubbed``.
        tube: The tube of the object's position.
        tracking: How axes are pulled to their nominal motions, None where the budget has no axes.
        axes: Number of axes (theta, q...).
    """
    return Alarms(
        _position_level(budget, tube),
        tube.rate + budget.single_noise * budget.velocity_noise + _mistaken_rate(budget, tube),
        _level_ahead(budget, tube),
        np.empty(0) if tracking is None else axis_reserve(budget, tracking, axes),
        budget.grasp_noise,
        budget.turn_noise,
    )


def _position_level(budget: Budget, tube: PositionTube) -> float:
    return tube.radius + budget.single_noise * budget.position_noise + budget.age_error * tube.velocity


def _level_ahead(budget: Budget, tube: PositionTube) -> float:
    unseen = unseen_of(budget)
    noise = budget.single_noise * (budget.position_noise + unseen * budget.velocity_noise)
    return tube.ahead + noise + budget.age_error * tube.velocity + unseen * _mistaken_rate(budget, tube)


def _mistaken_rate(budget: Budget, tube: PositionTube) -> float:
    """Return by how much the object's velocity is measured wrongly as ages are wrong [m/s]."""
    return budget.age_error * ((1.0 + budget.model_error) * tube.acceleration + budget.acceleration_error)


def unseen_of(budget: Budget) -> float:
    """Return how long nobody may know of a departure, see ``unseen_time`` [s]."""
    return unseen_time(budget.delay, budget.report_age, budget.period, budget.age_error)
