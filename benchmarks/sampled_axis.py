"""One axis under its law, sampled, delayed and disturbed, without a plant."""

from __future__ import annotations

from math import exp

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import FADING_TIME, bounds_of, track_row
from coop_drake.laws.hand_over import fading
from coop_drake.laws.slopes import slope_bounds
from coop_drake.tree.pose import FloatArray


@compiled
def run_axis(
    row: FloatArray,
    period: float,
    delay: int,
    lag: float,
    entry: tuple[float, float, float],
    jump: float,
    disturbances: FloatArray,
    model_factor: float,
    late: int,
    motion: FloatArray,
) -> bool:
    """Simulate an axis from its entry on and return whether it kept inside its funnel.

    Before the entry, x'' was constant. A command is held over a period, and x'' follows it with a first-order
    lag; in the middle of every period the funnel is looked at, too.

    Args:
        row: The axis, a row of an ``axis_table``.
        period: T [s].
        delay: Age of a measurement in periods.
        lag: Time constant of x'' [s].
        entry: x, x' and x'' at the entry.
        jump: What is added to the command and fades, see ``rest_jump``.
        disturbances: Errors of the measured position and rate, and of the acceleration, of every sample,
            shape (samples, 3).
        model_factor: Factor by which accelerations are larger than commanded [-].
        late: Periods for which the acceleration from before the entry is commanded on, until the robot hears
            of the switch.
        motion: Receives x, x' and x'' at every sample, shape (samples, 3).
    """
    n = disturbances.shape[0]
    x, v, p = entry
    old = p
    for k in range(n):
        motion[k, 0], motion[k, 1], motion[k, 2] = x, v, p
        lower, upper = bounds_of(row, k * period)[:2]
        if not lower < x < upper:
            return False
        if k < delay:
            ago = (delay - k) * period
            seen_x = entry[0] - ago * entry[1] + 0.5 * ago * ago * old
            seen_v = entry[1] - ago * old
        else:
            seen_x, seen_v = motion[k - delay, 0], motion[k - delay, 1]
        seen_x, seen_v = seen_x + disturbances[k, 0], seen_v + disturbances[k, 1]
        u = track_row(row, k * period, seen_x, seen_v)[0] + fading(k * period, row[FADING_TIME]) * jump
        u = model_factor * u + disturbances[k, 2] if k >= late else old
        for half in range(2):
            t = 0.5 * period
            left = exp(-t / lag) if lag > 0.0 else 0.0
            gap = p - u
            x += t * v + 0.5 * t * t * u + (lag * t - lag * lag * (1.0 - left)) * gap
            v += t * u + lag * (1.0 - left) * gap
            p = u + left * gap
            lower, upper = bounds_of(row, (k + 0.5 * (1 + half)) * period)[:2]
            if not lower < x < upper:
                return False
    return True


@compiled
def push_towards(
    row: FloatArray,
    period: float,
    delay: int,
    lag: float,
    size: FloatArray,
    model_factor: float,
    late: int,
    target: tuple[int, float],
    motion: FloatArray,
    disturbances: FloatArray,
) -> None:
    """Turn every disturbance so that it pushes the axis to one side at one sample, about its last motion.

    The law is linearised about the motion, and the adjoint equations say, backwards in time, how the position
    at that sample changes with each disturbance before.

    Args:
        row: The axis.
        period: T [s].
        delay: Age of a measurement in periods.
        lag: Time constant of x'' [s].
        size: Sizes of the three disturbances, shape (3,).
        model_factor: As in ``run_axis``, and so is ``late``.
        late: Periods for which the axis does not answer to measurements.
        target: The sample, and 1 to push upwards or -1 to push downwards.
        motion: The last motion, as ``run_axis`` writes it.
        disturbances: Receives the disturbances, shape (samples, 3).
    """
    last, side = target
    left = exp(-period / lag) if lag > 0.0 else 0.0
    in_v = lag * (1.0 - left)
    in_x = lag * (period - in_v)
    x, v, p = side, 0.0, 0.0
    answers = np.zeros((last + delay + 1, 2))
    for k in range(last - 1, -1, -1):
        pushed = (0.5 * period * period - in_x) * x + (period - in_v) * v + (1.0 - left) * p
        x, v, p = x, period * x + v, in_x * x + in_v * v + left * p
        slope = by_rate = 0.0
        if k >= late:
            seen_x, seen_v = motion[max(k - delay, 0), 0], motion[max(k - delay, 0), 1]
            slopes = slope_bounds(row, k * period, seen_x, 1e-9, seen_v)
            slope, by_rate = model_factor * slopes[0], model_factor * slopes[2]
        answers[k, 0], answers[k, 1] = slope * pushed, by_rate * pushed
        x, v = x + answers[k + delay, 0], v + answers[k + delay, 1]
        disturbances[k, 0] = size[0] if answers[k, 0] >= 0.0 else -size[0]
        disturbances[k, 1] = size[1] if answers[k, 1] >= 0.0 else -size[1]
        disturbances[k, 2] = size[2] if pushed >= 0.0 else -size[2]


def attacks(row: FloatArray, period: float, size: FloatArray, samples: int, seed: int) -> list[FloatArray]:
    """Return disturbances of the stated sizes that an axis should survive, each of shape (samples, 3).

    Constant ones, random ones, and square waves of several frequencies, whose signs push all one way.

    Args:
        row: The axis.
        period: T [s].
        size: Largest error of position, of rate and of the acceleration, shape (3,).
        samples: Number of samples.
        seed: Of the random ones.
    """
    generator = np.random.default_rng(seed)
    push = np.array([-1.0, -1.0, 1.0]) * size
    times = period * np.arange(samples)
    waves = [np.ones(samples), -np.ones(samples)]
    for frequency in (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 9.0):
        waves += [np.sign(np.sin(2.0 * np.pi * frequency * times + phase)) for phase in (0.01, 1.6)]
    pushed = [wave[:, None] * push for wave in waves]
    noisy = [size * generator.choice([-1.0, 1.0], (samples, 3)) for _ in range(4)]
    return [*pushed, *noisy]
