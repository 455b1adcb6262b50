"""The largest departure of the object's position from its nominal motion, computed again.

The object and its nominal motion are two points here, each carried over a control period in closed form: the
object as a double integrator behind a lag, the nominal motion as an oscillator about p_G. What the planner
adds up as powers of one matrix, this adds up as four runs: one with a unit of command for one period, one
with a kick of the velocity and one of the position, and one with a unit step of p_G.
"""

from __future__ import annotations

from cmath import cosh, exp, sinh, sqrt
from collections import deque
from collections.abc import Iterator
from math import ceil

import numpy as np

from coop_drake.answers.budget import Budget, PositionTube
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray

PARTS = 10
"""Parts into which the range of the model's error is cut [-]."""

HORIZON = 6.0
"""Time for which responses are summed [s]; a loop that takes longer to come to rest is refused."""

LEFT = 1e-7
"""Part of a unit response that may be left after that [m, m/s]: a hundred times what the planner leaves, so
that rounding refuses no plan."""

COMMAND, KICK, PLACE, STEP = range(4)
"""The runs: a unit of command, of velocity, of position, and of p_G."""


def oscillator(stiffness: float, damping: float, time: float) -> FloatArray:
    """Return the matrix that carries position and velocity of a damped oscillator, shape (2, 2).

    Args:
        stiffness: K [1/s^2].
        damping: zeta [1/s].
        time: T [s].
    """
    half = 0.5 * damping
    root = sqrt(half * half - stiffness)
    even, odd = cosh(root * time), sinh(root * time) / root if abs(root * time) > 1e-6 else time
    decay = exp(-half * time)
    rows = [[even + half * odd, odd], [-stiffness * odd, even - half * odd]]
    matrix: FloatArray = (decay * np.array(rows)).real
    return matrix


def position_bounds(tube: PositionTube, stiffness: float, damping: float, budget: Budget) -> FloatArray:
    """Return the least radius, rate, velocity, rest, command and what is ahead that a tube states, (6,).

    Args:
        tube: The tube.
        stiffness: K of the nominal motion [1/s^2].
        damping: zeta of the nominal motion [1/s].
        budget: The budget.

    Raises:
        RefusalError: The loop does not come to rest.
    """
    parts = PARTS if budget.model_error > 0.0 else 1
    rest = budget.model_error / parts
    errors = budget.model_error * (np.arange(1, 2 * parts, 2) / parts - 1.0)
    sums = _sums(tube, oscillator(stiffness, damping, budget.period), stiffness, damping, budget, errors)
    noise = tube.tracking_stiffness * budget.position_noise + tube.tracking_damping * budget.velocity_noise
    gain, nominal = 1.0 - rest * sums[KICK, 2], tube.speed * sums[STEP, 3]
    if not (gain > 0.0).all():
        raise RefusalError("tube", "the error of the model may exceed what the loop makes up for")

    def bounds(wrong: FloatArray, speed: float) -> FloatArray:
        """Return |e| at samples, |e'|, |p'|, |u|, |p''| and |e + t e'|, shape (6, parts)."""
        entering = wrong * sums[COMMAND] + budget.acceleration_error * sums[KICK]
        asked = (entering[2] + wrong + speed * sums[STEP, 5]) / gain  # p_G leads it, feedback included
        entering = entering + speed * sums[STEP]
        off, fast = entering[:2] + rest * asked * sums[KICK, :2]
        pushed = (1.0 + budget.model_error) * asked + budget.acceleration_error
        fast = fast + budget.period / 2.0 * (pushed + speed * sums[STEP, 3])
        quick = speed * sums[STEP, 4] + fast + budget.period / 2.0 * speed * sums[STEP, 3]
        return np.array([off, fast, quick, asked, pushed, entering[6] + rest * asked * sums[KICK, 6]])

    def settled(speed: float) -> FloatArray:
        """Return the bounds where measurements are of wrong instants, too, by which commands are wrong."""
        least, unit = (bounds(np.full(len(errors), one), speed) for one in (0.0, 1.0))  # both are straight
        caused = (
            2.0
            * budget.clock_error
            * np.array(
                [
                    tube.tracking_stiffness * one[2] + tube.tracking_damping * one[4]
                    for one in (least, unit - least)
                ]
            )
        )
        if not (caused[1] < 1.0).all():
            raise RefusalError("budget.clock_error", "the loop does not make up for such an error of clocks")
        return bounds((noise + caused[0]) / (1.0 - caused[1]), speed)

    off, fast, quick, asked, pushed, ahead = settled(tube.speed)
    between = budget.period**2 / 8.0 * (pushed + nominal)
    single = asked + (budget.single_noise - 1.0) * noise  # of one robot, not of their mean
    single = (1.0 + errors + rest) * single  # by its masses, which are as wrong as in this part
    still = settled(0.0)[0] + between
    return np.array([value.max() for value in (off + between, fast, quick, still, single, ahead)])


def unseen_in(budget: Budget) -> float:
    """Return for how long nobody may know of a departure [s].

    In the age of the measurements, in that of reports, each in whole periods, in one period more, and in what
    clocks hide of the age.
    """
    T = budget.period
    known = T * (1 + ceil(budget.delay / T - 1e-9) + ceil(budget.report_age / T - 1e-9))
    return known + 2.0 * budget.clock_error


def may_rest(tube: PositionTube, stiffness: float, damping: float, budget: Budget, rate: float) -> bool:
    """Whether the tube holds for an object that begins with all constant errors and a small rate, too.

    Nothing entered the loop before that. So what the tube counts for earlier errors of rates and
    accelerations must be more than what the rate causes, at every sample, of e, e' and the feedback: the one
    there is, and the ones of any sign in the measurements that are used first. Constant errors of the
    position are among those that the tube counts.

    Args:
        tube: The tube.
        stiffness: K of the nominal motion [1/s^2].
        damping: zeta of the nominal motion [1/s].
        budget: The budget.
        rate: The rate [m/s].
    """
    flow, T = oscillator(stiffness, damping, budget.period), budget.period
    parts = PARTS if budget.model_error > 0.0 else 1
    errors = budget.model_error * (np.arange(1, 2 * parts, 2) / parts - 1.0)
    damper, delay = tube.tracking_damping, ceil(budget.delay / budget.period - 1e-9)
    caused, entered, recent = [], [], deque[FloatArray](maxlen=delay)
    for found in _followed(tube, flow, stiffness, damping, budget, errors):
        sizes = np.abs(found[:3, :3])
        if delay:
            recent.append(sizes[COMMAND])
        caused.append(rate * (sizes[KICK] + damper * np.sum(recent or [0.0 * sizes[COMMAND]], axis=0)))
        pushed = T * mean_size(found[KICK, :3], found[KICK, :3] + T * found[PLACE, :3])
        entered.append(damper * budget.velocity_noise * sizes[COMMAND] + budget.acceleration_error * pushed)
    left = np.flip(np.cumsum(np.flip(entered, 0), axis=0), 0)
    return bool((np.array(caused)[:-1] <= left[1:] + LEFT).all())


def _sums(
    tube: PositionTube,
    flow: FloatArray,
    stiffness: float,
    damping: float,
    budget: Budget,
    errors: FloatArray,
) -> FloatArray:
    """Return the sums of absolute responses, shape (4 runs, 7, parts).

    They are those of e, e', feedback, nominal acceleration, nominal velocity, the command, which is the sum
    of feedback and nominal acceleration, and e + t e'.

    The second run's are those to a unit of acceleration at all times, the fourth run's those to a unit of
    speed of p_G; the third run's are not used.
    """
    T, sums, unseen = budget.period, np.zeros((4, 7, len(errors))), unseen_in(budget)
    for found in _followed(tube, flow, stiffness, damping, budget, errors):
        found = np.concatenate([found, found[:, :1] + unseen * found[:, 1:2]], axis=1)
        sums[[COMMAND, STEP]] += np.abs(found[[COMMAND, STEP]])
        sums[KICK] += mean_size(found[KICK], found[KICK] + T * found[PLACE])
    sums[[KICK, STEP]] *= T
    return sums


def _followed(
    tube: PositionTube,
    flow: FloatArray,
    stiffness: float,
    damping: float,
    budget: Budget,
    errors: FloatArray,
) -> Iterator[FloatArray]:
    """Yield the responses of ``_sums`` sample by sample, each of shape (4 runs, 6, parts).

    Raises:
        RefusalError: The loop does not come to rest.
    """
    T, delay = budget.period, ceil(budget.delay / budget.period - 1e-9)
    p, v, s = np.zeros((3, 4, len(errors)))
    q, w, goal = np.zeros((3, 4, 1))  # the nominal motion and p_G, which only the last run moves
    v[KICK], p[PLACE], goal[STEP] = 1.0, 1.0, 1.0
    past = deque([(0.0 * p, 0.0 * v)] * delay, maxlen=delay + 1)
    for k in range(ceil(HORIZON / T)):
        past.append((p - q, v - w))
        old, old_rate = past[0]
        feedback = -tube.tracking_stiffness * old - tube.tracking_damping * old_rate
        nominal = -stiffness * (q - goal) - damping * w
        command = feedback + nominal
        yield np.stack(np.broadcast_arrays(p - q, v - w, feedback, nominal, w, command), axis=1)
        if k == 0:
            command[COMMAND] += 1.0
        p, v, s = carried(p, v, s, command, 1.0 + errors, budget.lag, T)
        q, w = goal + flow[0, 0] * (q - goal) + flow[0, 1] * w, flow[1, 0] * (q - goal) + flow[1, 1] * w
    if not max(np.abs(p - q).max(), np.abs(v - w).max()) < LEFT:
        raise RefusalError("tube.tracking_stiffness", f"the position has not come to rest after {HORIZON} s")


def mean_size(first: FloatArray, last: FloatArray) -> FloatArray:
    """Return the mean of |x| while x goes evenly from one value to another."""
    span = np.maximum(np.abs(last - first), 1e-300)
    mean: FloatArray = np.where(
        first * last >= 0.0, 0.5 * np.abs(first + last), 0.5 * (first**2 + last**2) / span
    )
    return mean


def carried(
    p: FloatArray, v: FloatArray, s: FloatArray, command: FloatArray, factor: FloatArray, lag: float, T: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Carry position, velocity and the lagging acceleration over a period in which a command is held."""
    if lag == 0.0:
        return p + T * v + 0.5 * T * T * factor * command, v + T * factor * command, command
    gone = -np.expm1(-T / lag)
    late = s - command
    turned = v + factor * (T * command + lag * gone * late)
    moved = p + T * v + factor * (0.5 * T * T * command + lag * (T - lag * gone) * late)
    return moved, turned, command + (1.0 - gone) * late
