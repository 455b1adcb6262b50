"""What is measured: instants, errors, losses on the way, and what robots make of it."""

from __future__ import annotations

from math import ceil, cos, floor, log, pi, sin, sqrt

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.robot_dynamics import (
    base_acceleration,
    end_effector_command,
    estimate_object,
    motion_room,
)
from coop_drake.tree.arrays import FloatArray

# Times in control periods.

_ROUNDING = 1e-9
"""Share of a period by which a time may exceed whole periods and count as these [-]: decimal numbers such as
0.015 s have rounding errors that are far smaller, and no simulated delay is that short."""


def whole_periods(time: float, period: float) -> int:
    """Return the number of periods that a time takes, rounded up unless it is whole up to rounding errors.

    The simulation delays by it, and budgets count it, so that none is certified for a shorter delay.

    Args:
        time: The time [s].
        period: The control period [s].
    """
    return ceil(time / period - _ROUNDING)


_LATE = 1e-6
"""Share of a period by which a sample may seem to be early [-]: times of samples are multiples of the period
up to rounding errors, which are far smaller."""


def period_of(time: float, period: float, offset: float = 0.0) -> int:
    """Return the number of the control period that a time is in, 0 for the first one.

    Args:
        time: The time [s].
        period: The control period [s].
        offset: When the first period begins [s].
    """
    return max(int((time - offset) / period + _LATE), 0)


# Random numbers that follow from a seed and a number, such as that of a control period, and nothing else.
#
# They are computed by Philox4x32-10 (Salmon, Moraes, Dror and Shaw, 2011, "Parallel random numbers: as easy
# as 1, 2, 3"): a bijection of 128 bits, the counter, that depends on 64 bits, the key. Nothing is kept from
# one draw to the next, so that a draw is the same in whatever order, in a block or in a compiled loop.

_WORD = 0xFFFFFFFF
_UNIT = 2.0**-32
"""A word of 32 bits times this is in [0, 1) [-]."""

_FACTOR_0, _FACTOR_1 = 0xD2511F53, 0xCD9E8D57
_STEP_0, _STEP_1 = 0x9E3779B9, 0xBB67AE85
_ROUNDS = 10
"""Multipliers, steps of the key and number of rounds, as published."""


@compiled(borrows=True)
def random_words(counter: tuple[int, int, int, int], key: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return the four words of Philox4x32-10, each from 0 to 2^32 - 1.

    Args:
        counter: Four words of 32 bits.
        key: Two words of 32 bits.
    """
    a, b, c, d = counter
    k, m = key
    for _ in range(_ROUNDS):
        # Products may overflow 63 bits, which changes only bits that the masks take away.
        p, q = _FACTOR_0 * a, _FACTOR_1 * c
        a, b, c, d = ((q >> 32) & _WORD) ^ b ^ k, q & _WORD, ((p >> 32) & _WORD) ^ d ^ m, p & _WORD
        k, m = (k + _STEP_0) & _WORD, (m + _STEP_1) & _WORD
    return a, b, c, d


@compiled
def uniform_pair(seed: int, number: int) -> tuple[float, float]:
    """Return two independent numbers that are uniform in [0, 1), in steps of 2^-32 [-].

    Args:
        seed: Which sequence, from 0 to 2^32 - 1.
        number: Which pair of the sequence, not negative.
    """
    words = random_words((number & _WORD, number >> 32, 0, 0), (seed, 0))
    return _UNIT * words[0], _UNIT * words[1]


# Errors of what a sensor measures once in every control period: normal noise and square waves.


@compiled(borrows=True)
def write_errors(
    seed: int, deviations: FloatArray, waves: FloatArray, number: int, errors: FloatArray
) -> None:
    """Write the errors of all components of a measurement in one control period.

    Each is its deviation times a number with a standard normal distribution, by the formula of Box and
    Muller, and its wave: its size in the first half of every wave and minus that in the second. No normal
    number is beyond 6.7 standard deviations, because uniform numbers come in steps of 2^-32.

    Args:
        seed: Seed of the noise, from 0 to 2^32 - 1.
        deviations: Standard deviations of the noise, shape (n,).
        waves: Of every component's wave its size, its length in control periods, positive, and how much of a
            wave has passed at number 0, in waves, shape (n, 3).
        number: Number of the period, not negative.
        errors: Receives the errors, shape (n,).
    """
    for i in range(0, errors.size, 4):
        words = random_words((number & _WORD, number >> 32, 1 + i, 0), (seed, 0))
        for k in range(2):
            length = sqrt(-2.0 * log(_UNIT * (words[2 * k] + 0.5)))
            angle = 2.0 * pi * _UNIT * words[2 * k + 1]
            first = i + 2 * k
            if first + 1 < errors.size:  # Both, so that one function of the C library makes both.
                errors[first], errors[first + 1] = length * cos(angle), length * sin(angle)
            elif first < errors.size:
                errors[first] = length * cos(angle)
    for i in range(errors.size):
        errors[i] *= deviations[i]
        size = waves[i, 0]
        if size != 0.0:
            passed = number / waves[i, 1] + waves[i, 2]
            errors[i] += size if passed - floor(passed) < 0.5 else -size


TURN = 2.0 * pi
"""A turn [rad]."""


# What channels hold that lose and delay what they carry: reports of robots, and measurements.

NOTHING = -1.0
"""First number of a message or measurement that is none; cells and measurements are numbered from 0 [-]."""


def channel_rows(delay: int) -> int:
    """Return how many reports a channel holds: the one heard, and those of so many periods to come.

    Args:
        delay: Periods that a report travels; a repeated one travels twice as long, at least one period more.
    """
    return 1 + delay + max(delay, 1)


@compiled(borrows=True)
def carry_reports(
    kept: FloatArray, sent: FloatArray, arrives: bool, repeated: bool, delay: int, arrivals: FloatArray
) -> None:
    """Write what a channel holds a period later: the report heard, then those of the next periods.

    A report that arrives is there ``delay`` periods later, a repeated one again in the last row, unless a
    newer one arrives then.

    Args:
        kept: What the channel holds, shape (``channel_rows``, 2): the report heard, then what arrives in each
            of the next periods, beginning with ``NOTHING`` where nothing does.
        sent: Report of this period, shape (2,).
        arrives: Whether it is not lost.
        repeated: Whether it arrives twice.
        delay: Periods that it travels.
        arrivals: Receives what the channel holds then, of the same shape.
    """
    last = kept.shape[0] - 1
    for i in range(last):
        arrivals[i, 0], arrivals[i, 1] = kept[i + 1, 0], kept[i + 1, 1]
    arrivals[last, 0], arrivals[last, 1] = NOTHING, NOTHING
    if arrives:
        arrivals[delay, 0], arrivals[delay, 1] = sent[0], sent[1]
        if repeated:
            arrivals[last, 0], arrivals[last, 1] = sent[0], sent[1]
    if arrivals[0, 0] < 0.0:
        arrivals[0, 0], arrivals[0, 1] = kept[0, 0], kept[0, 1]


@compiled(borrows=True)
def carry_measurements(
    kept: FloatArray, number: int, measured: FloatArray, lost: bool, late: bool, following: FloatArray
) -> None:
    """Write what a line of measurements holds a period later: the newest that arrived, then late ones.

    A measurement that is lost leaves the newest one standing; a late one is the newest when it arrives,
    unless a newer one has arrived.

    Args:
        kept: Numbers and values of the newest that has arrived, then of what arrives in each of the next
            periods, with the number ``NOTHING`` where nothing does, shape (r, 1 + n).
        number: Of the present measurement.
        measured: Its values, shape (n,).
        lost: Whether it is lost.
        late: Whether it is late, by r periods, if it is not lost.
        following: Receives what the line holds then, shape (r, 1 + n).
    """
    rows, columns = following.shape
    for i in range(rows):
        for j in range(columns):
            following[i, j] = kept[i + 1, j] if i + 1 < rows else NOTHING
    if late and not lost:
        following[rows - 1, 0] = number
        for j in range(1, columns):
            following[rows - 1, j] = measured[j - 1]
    if following[0, 0] <= kept[0, 0]:
        for j in range(columns):
            following[0, j] = kept[0, j]
    if not (lost or late) and number > following[0, 0]:
        following[0, 0] = number
        for j in range(1, columns):
            following[0, j] = measured[j - 1]


# A predictor: the present state from delayed measurements and from what was commanded since.


def predict(
    chain: FloatArray,
    p_LE: FloatArray,
    robot: FloatArray,
    pose: FloatArray,
    accelerations: FloatArray,
    period: float,
    predicted: FloatArray,
    predicted_pose: FloatArray,
) -> None:
    """Write a robot's state and the object's pose as many periods later as accelerations are given.

    The law makes every coordinate a double integrator, whose acceleration a is constant for a period T:
    x + T x' + T^2 a / 2 and x' + T a.

    Args:
        chain: From the robot's base to its end effector.
        p_LE: The grasp in L, shape (2,) [m].
        robot: (z_k, z_k') as measured, shape (2 (3 + n),).
        pose: Pose of the object as measured, shape (3,) [m, rad].
        accelerations: For each period since, from the first on, those of the object and of z_k, shape
            (periods, 6 + n) [m/s^2 or rad/s^2].
        period: T [s].
        predicted: Receives (z_k, z_k'), shape (2 (3 + n),).
        predicted_pose: Receives the object's pose, shape (3,).
    """
    state, n = np.empty(6), robot.size // 2
    estimate_object(chain, p_LE, motion_room(chain), robot, pose, state)
    predicted[:] = robot
    for row in accelerations:
        state[:3] += period * (state[3:] + 0.5 * period * row[:3])
        state[3:] += period * row[:3]
        predicted[:n] += period * (predicted[n:] + 0.5 * period * row[3:])
        predicted[n:] += period * row[3:]
    predicted_pose[:] = state[:3]


def wanted_accelerations(
    chain: FloatArray,
    load: FloatArray,
    robot: FloatArray,
    pose: FloatArray,
    linear: FloatArray,
    axes: FloatArray,
    accelerations: FloatArray,
) -> None:
    """Write the accelerations of the object and of a robot's z_k that the law asks for, shape (6 + n,).

    Args:
        chain: From the robot's base to its end effector.
        load: The robot's load, as ``end_effector_command`` takes it, shape (7,).
        robot: (z_k, z_k'), shape (2 (3 + n),).
        pose: Pose of the object, shape (3,) [m, rad].
        linear: Desired acceleration of the object's origin, shape (2,) [m/s^2].
        axes: Desired accelerations of the object's angle and of the joints, shape (1 + n,).
        accelerations: Receives those of the object (3), of the base (3) and of the joints (n).
    """
    state, command, motion = np.empty(6), np.empty(6), motion_room(chain)
    estimate_object(chain, load[:2], motion, robot, pose, state)
    end_effector_command(load, state, linear, axes, command)
    accelerations[:2], accelerations[2] = linear, axes[0]
    accelerations[3:6] = base_acceleration(chain, motion, robot, command, axes)
    accelerations[6:] = axes[1:]


# A disturbance observer: what accelerates the object and the joints beside the commands.

PHASE = 0.15
"""The observer's gain times the age of commands [rad]: the age turns the observer's loop by as much, less
than half of the phase that scheduled gains leave to the age."""

FASTEST = 20.0
"""Largest gain of the observer [1/s]: noise of 0.01/s in a rate makes 0.2/s^2 in its estimate."""

LEAK = 0.2
"""Leak over gain [-]: one sixth of a constant disturbance stays. Without a leak, estimates of different
robots would drift apart, which a rigid team does not feel but as forces inside the object."""


def observer_gains(age: float) -> tuple[float, float]:
    """Return the gain l and the leak of ``observe`` for an age of commands [1/s].

    Args:
        age: Mean age of the measurements on which an effort rests [s].
    """
    gain = min(PHASE / age, FASTEST) if age > 0.0 else FASTEST
    return gain, LEAK * gain


def observe(
    rates: FloatArray,
    wanted: FloatArray,
    state: FloatArray,
    gain: float,
    leak: float,
    state_rate: FloatArray,
    disturbance: FloatArray,
) -> None:
    """Write the estimate of the acceleration d that acts beside the command, and the observer's rate.

    With the rate v of a coordinate, the acceleration u that the law wants, and the observer's state z,

        d^ = l (v - z),    z' = u + g (v - z),

    and the command u - d^, the coordinate has v' = u - d^ + d, so that d^' = l (d - d^) - g d^: whatever the
    law is, d^ tends to d l / (l + g) like exp(-(l + g) t), and the law is left with the rest.

    Args:
        rates: v of every coordinate, shape (m,) [m/s or rad/s].
        wanted: u of every coordinate, shape (m,) [m/s^2 or rad/s^2].
        state: z of every coordinate, shape (m,) [m/s or rad/s].
        gain: l [1/s].
        leak: g [1/s].
        state_rate: Receives z', shape (m,).
        disturbance: Receives d^, shape (m,) [m/s^2 or rad/s^2].
    """
    ahead = rates - state
    state_rate[:] = wanted + leak * ahead
    disturbance[:] = gain * ahead
