"""The levels of a plan's monitors, and the room that they need: see ``laws/readiness.py``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from coop_drake.answers.budget import Alarms, AxisTracking, Budget, PositionTube
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.readiness import unseen_time
from coop_drake.robustness.nominal_axes import AxisSets
from coop_drake.tree.arrays import FloatArray

if TYPE_CHECKING:
    from coop_drake.robustness.axis_departure import Departures, Inflow


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


# What the monitors of axes see, and what they may miss.
#
# While a robot measures an axis at its levels a of |e| and c of |e + t e'| at most, the axis is off its
# nominal motion by at most a + n, and by c + n + t n_v after the time t in which no report tells of more.
# Between, it is on the straight way from the one to the other, and off that by what drives it meanwhile: by
# at most the sum of d_j u T over the periods j since, u being how long ago the middle of a period is, with d
# as in ``axis_departure``: the error of the model in the nominal acceleration, ``axis_error`` and friction.
# The pull is not among d; it draws back what it sees. So the axis stays in its funnel where
#
# max(a + n, c + n + t n_v) <= distance of the nominal axis - sum of d_j u T
#
# at all times until t later, also where the cell has been left meanwhile. Levels may be as low as
# D + n_1, where D is what the budget can cause then. Both sides change in a transition: where it accelerates
# the most an axis departs the most, and where its funnel is closed there is the least room. So a plan states
# levels for stages of the time since the entry.


class AxisRoom(NamedTuple):
    """What monitors of axes see, and what they may miss, at all samples; the last one is for ever.

    Attributes:
        least: Least levels of |e| and |e + t e'| that nothing within the budget exceeds, shape (2, samples,
            axes) [rad or m].
        room: Distance of the nominal axis to its funnel's bounds, less what drives the axis away unseen, from
            the sample until the next one, shape (samples, axes) [rad or m].
    """

    least: FloatArray
    room: FloatArray


def axis_room(
    budget: Budget, tracking: AxisTracking, sets: Sequence[AxisSets], away: Departures, before: Inflow
) -> AxisRoom:
    """Return what monitors of axes see and may miss in a transition.

    Args:
        budget: The budget.
        tracking: How axes are pulled to their nominal motions.
        sets: The sets of their nominal motions.
        away: How far they depart.
        before: What entered their loops before this transition.
    """
    samples, axes, T = *away.position.shape, budget.period
    unseen = whole_periods(unseen_of(budget), T)
    earlier = [before.state[0].max(axis=0)] * (unseen + 1), before.past[0].max(axis=0).T
    drives = np.concatenate([np.concatenate(earlier)[-unseen - 1 :], away.entered.max(axis=2)])
    drives[1:] = np.maximum(drives[1:], drives[:-1])  # within a period, it is that or the one before
    room = np.stack([one.distances(samples - 1) for one in sets], axis=1)
    for j in range(unseen):
        driven = drives[unseen + 1 - j : unseen + 1 - j + samples].copy()
        driven[-1] = drives[-unseen - 1 :].max(axis=0)  # for ever, as large as it then is in any period
        room -= (j + 0.5) * T * T * driven
    if budget.age_error:  # what was measured then belonged to another instant
        moving = np.stack([one.moving(samples - 1, T) for one in sets], axis=2)
        rate, push = moving[1] + away.rate, moving[0] + away.acceleration
        values = rate + unseen_of(budget) * push
        if tracking.rate:  # what is judged first may have been measured in the cell before
            known = np.array(tracking.rate) + unseen_of(budget) * np.array(tracking.acceleration)
            values[: unseen + 1] = np.maximum(values[: unseen + 1], known)
        room -= budget.age_error * _since(values, unseen + 1)
    own = _noises(budget, np.where(np.arange(axes) > 0, 1.0, budget.single_noise))
    wrong = mistaken(budget, tracking, axes)
    own += np.stack([wrong[0], wrong[0] + unseen_of(budget) * wrong[1]])
    return AxisRoom(np.stack([away.position, away.ahead]) + own[:, None], room)


def of_stage(seen: AxisRoom, budget: Budget, first: int, end: int) -> tuple[FloatArray, FloatArray]:
    """Return the least levels in a stage, shape (2, axes), and how far axes may be off, shape (axes,).

    Robots hear of a switch a period late, and clocks may be wrong: levels may be those of another period.

    Args:
        seen: What monitors see and may miss.
        budget: The budget.
        first: First sample of the stage.
        end: First sample of the next one; no less than the number of samples where there is none.
    """
    late = 1 + whole_periods(budget.age_error, budget.period)
    begin, unseen = max(first - late, 0), whole_periods(unseen_of(budget), budget.period)
    begin = min(begin, len(seen.room) - 1)
    return seen.least[:, begin : end + late].max(axis=1), seen.room[begin : end + late + unseen].min(axis=0)


def room_at_entry(seen: AxisRoom, budget: Budget) -> FloatArray:
    """Return how far off axes may be by what a monitor in the cell before has missed, shape (axes,)."""
    return of_stage(seen, budget, 0, 0)[1]


def may_miss(budget: Budget, levels: FloatArray) -> FloatArray:
    """Return how far off axes may be while no report tells, by either level, shape (2, axes) [rad or m].

    Args:
        budget: The budget.
        levels: Of |e| and |e + t e'|, shape (2, axes) [rad or m].
    """
    return levels + _noises(budget, np.ones(levels.shape[1]))


def rate_noises(budget: Budget, tracking: AxisTracking, axes: int) -> FloatArray:
    """Return the largest errors of one robot's measured rates of axes, shape (axes,) [rad/s or m/s].

    All robots measure the object's angle, each its own joints.
    """
    noises: FloatArray = budget.rate_noise + mistaken(budget, tracking, axes)[1]
    noises[0] += (budget.single_noise - 1.0) * budget.rate_noise
    return noises


def leaving_since(budget: Budget, leaving: int) -> int:
    """Return the first sample of which no report may tell when the cell is left, by when that can be."""
    late = 1 + whole_periods(budget.age_error, budget.period)
    return max(leaving - whole_periods(unseen_of(budget), budget.period) - late, 0)


def _noises(budget: Budget, share: FloatArray) -> FloatArray:
    """Return errors of measured e and e + t e', shares of noise being given for all axes, shape (2, axes)."""
    ahead = budget.angle_noise + unseen_of(budget) * budget.rate_noise
    return np.outer([budget.angle_noise, ahead], share)


def _since(values: FloatArray, periods: int) -> FloatArray:
    """Return the largest values of some periods until each of them, shape (samples, axes)."""
    largest = values.copy()
    for j in range(1, min(periods + 1, len(values))):
        largest[j:] = np.maximum(largest[j:], values[:-j])
    return largest


def alarms_of(budget: Budget, tube: PositionTube) -> Alarms:
    """Return the levels that all transitions have in common.

    Args:
        budget: The budget, see ``rubbed``.
        tube: The tube of the object's position.
    """
    return Alarms(
        _position_level(budget, tube),
        tube.rate + budget.single_noise * budget.velocity_noise + _mistaken_rate(budget, tube),
        _level_ahead(budget, tube),
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
