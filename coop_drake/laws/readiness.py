"""When a robot is ready for the next cell, has arrived, or departs from its nominal motion."""

from __future__ import annotations

from math import atan2, cos, hypot, inf, isfinite, sin, sqrt
from typing import NamedTuple

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import ENERGY_BOUND, GOAL_LOWER, GOAL_UPPER, track_row
from coop_drake.laws.governor import energy_margin
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.robot_dynamics import PX, PY, rotated
from coop_drake.tree.arrays import FloatArray

# When a robot reports that it is ready to leave a cell, or that the goal is reached (after (10)-(12)).
#
# Every margin is a number without unit, positive where the condition holds and at most 1. The margin of
# several conditions is the smallest. A robot judges by the object's state, its own p_G and its own joints,
# never by those of another robot.

EROSION = 0.1
"""Fraction of a goal interval's width, at each end, in which an axis does not count as arrived [-]. Erratum
E17b: near the end of its next slice an axis would be accelerated without bound."""

CLEARANCE_FRACTION = 0.5
"""The object must provably stay in the next cell within this fraction of the goal region's inradius [-];
p_G rests at the middle of the goal region, so the condition is met there with the same distance to spare."""

SPEED_TOLERANCE = 0.01
"""Largest speed of the object's origin that counts as rest [m/s]: what a person would call still."""

RATE_TOLERANCE = 0.02
"""Largest rate of an axis that counts as rest [rad/s or m/s]: at half a metre the speed of
``SPEED_TOLERANCE``."""


@compiled
def interval_margin(position: float, lower: float, upper: float, erosion: float = EROSION) -> float:
    """Return by how much an axis is inside its interval eroded at both ends, 1 in the middle.

    Args:
        position: x [rad or m].
        lower: Lower end [rad or m].
        upper: Upper end, above the lower one [rad or m].
        erosion: Fraction of the width that is taken away at each end, below one half [-].
    """
    half = 0.5 * (upper - lower) * (1.0 - 2.0 * erosion)
    return 1.0 - abs(position - 0.5 * (lower + upper)) / half


@compiled
def clearance_margin(margin: float, stiffness: float, inradius: float) -> float:
    """Return (Delta E - floor) / max(|Delta E|, floor), the floor being (K / 2) (R / 2)^2: erratum E10.

    It is positive where the object provably stays in the next cell, and therefore is in it already.

    Args:
        margin: Delta E of the next cell with the next cell's K [m^2/s^2].
        stiffness: The next cell's K [1/s^2].
        inradius: R, distance of the target to the boundary of the goal region [m].
    """
    floor = energy_margin(0.0, CLEARANCE_FRACTION * inradius, stiffness)
    return (margin - floor) / max(abs(margin), floor)


@compiled
def position_arrival(distance: float, speed: float, tolerance: float) -> float:
    """Return by how much the object's origin is at the goal and at rest.

    Args:
        distance: Distance to the goal position [m].
        speed: Speed of the origin [m/s].
        tolerance: Largest distance that counts as arrived, less ``EROSION`` of it [m].
    """
    return min(1.0 - distance / ((1.0 - EROSION) * tolerance), 1.0 - speed / SPEED_TOLERANCE)


@compiled(borrows=True)
def axis_ready(row: FloatArray, next_row: FloatArray, position: float, rate: float) -> tuple[float, float]:
    """Return the margins with which one axis may enter the next cell: inside its goal, and V small enough.

    V is that at the beginning of the next funnel, with the next gains.

    Args:
        row: The axis in the current cell, a row of an ``axis_table``.
        next_row: The axis in the next cell.
        position: x [rad or m].
        rate: x' [rad/s or m/s].
    """
    energy, bound = track_row(next_row, 0.0, position, rate)[1], next_row[ENERGY_BOUND]
    inside = interval_margin(position, row[GOAL_LOWER], row[GOAL_UPPER])
    return inside, (bound - energy) / max(energy, bound)


@compiled(borrows=True)
def axis_arrival(row: FloatArray, position: float, rate: float) -> float:
    """Return the margin with which, in the last cell, one axis is inside its goal and at rest."""
    inside = interval_margin(position, row[GOAL_LOWER], row[GOAL_UPPER])
    return min(inside, 1.0 - abs(rate) / RATE_TOLERANCE)


# When a sampled robot says that the goal is reached: by the pose and the joints that it measures, averaged.
#
# A robot remembers what it measured, raw, in two times of ``MEAN_TIME``, one after the other, W samples
# each. With their means m_0 and m_1, the newer ones' standard deviation s, and d^2 half the mean square of
# the differences of one to the next, it has arrived where
#
# |m_1 - goal| <= tolerance - max(e, e_s), |m_1 - m_0| <= r + 2 (e + e_s), s^2 <= 2.5 d^2 + (r + e)^2.
#
# e is the certified error of what it measures; in the first inequality a tenth of the tolerance counts
# where that is more (erratum E17b). e_s = c s / root W is the error of the mean by how the samples scatter,
# and r what counts as rest in ``MEAN_TIME``. In noise that is independent from sample to sample s and d are
# alike; s is larger where the object moves to and fro. What all samples have in common, as a bias, does not
# show.

MEAN_TIME = 0.1
"""Time over which robots average what they measure [s]: long against a control period, so that noise averages
out, and short beside a transport. What counts as rest moves by at most 1 mm and 2 mrad meanwhile."""

PLANE_DEVIATIONS = 3.44
"""c for positions in the plane [-]: a normal vector is rarely longer than so many standard deviations of a
coordinate, as rarely as a normal number is beyond ``DEVIATIONS`` of its own."""

DEVIATIONS = 3.0
"""c for angles and joints [-]: one number in 370 is beyond."""

SCATTER = 2.5
"""Largest s^2 over d^2 in noise [-]: of 20 independent numbers the share has a deviation of 0.2 about 1."""

FAR = -1.0
"""Margin of a robot that has not measured for long enough; one whose monitor is not quiet has no larger one
[-]."""


class ArrivalGoal(NamedTuple):
    """What a robot compares its means with.

    Attributes:
        place: Where the object shall be, then its angle and the robot's own joints, shape (3 + n,); the value
            of a free joint is not read [m, rad].
        tolerances: Largest distance of the object from its place, then the tolerances of the angle and the
            joints, infinite for free ones, shape (2 + n,) [m, rad].
        errors: Certified errors of what is measured, in this order, shape (2 + n,) [m, rad].
    """

    place: FloatArray
    tolerances: FloatArray
    errors: FloatArray


def mean_samples(period: float) -> int:
    """Return W, the number of samples of a mean, at least two."""
    return max(2, whole_periods(MEAN_TIME, period))


@compiled(borrows=True)
def arrival_margin(
    place: FloatArray, tolerances: FloatArray, errors: FloatArray, recent: FloatArray, newest: int
) -> float:
    """Return the margin with which a robot has arrived by what it measures, arrived if not negative [-].

    Args:
        place: This and the next two arguments are the fields of an ``ArrivalGoal``; see there.
        tolerances: The tolerances.
        errors: The certified errors.
        recent: (x, y, theta, own joints) as measured at the last 2 W samples, infinite where there were
            fewer, shape (2 W, 3 + n) [m, rad].
        newest: The row of the newest ones; the older ones stand before it, the last row before the first.
    """
    margin, rows = 1.0, recent.shape[0]
    x = (0.0, 0.0, 0.0, 0.0)  # m_1, m_0, s^2 and d^2 of the object's first coordinate
    half = rows // 2
    for column in range(recent.shape[1]):
        mean = before = scatter = steps = 0.0  # m_1, m_0, s^2 and d^2
        for i in range(half):
            mean += recent[(newest - i) % rows, column] / half
            before += recent[(newest - half - i) % rows, column] / half
        for i in range(half):
            value = recent[(newest - i) % rows, column]
            scatter += (value - mean) ** 2 / (half - 1)
            if i + 1 < half:
                steps += 0.5 * (value - recent[(newest - i - 1) % rows, column]) ** 2 / (half - 1)
        if not isfinite(before):
            return FAR
        if column == 0:  # It is judged with the next one.
            x = mean, before, scatter, steps
            continue
        if column == 1:
            away, moved = hypot(x[0] - place[0], mean - place[1]), hypot(x[0] - x[1], mean - before)
            scatter, steps = 0.5 * (x[2] + scatter), 0.5 * (x[3] + steps)
            rest, deviations = MEAN_TIME * SPEED_TOLERANCE, PLANE_DEVIATIONS
        else:
            away, moved = abs(mean - place[column]), abs(mean - before)
            rest, deviations = MEAN_TIME * RATE_TOLERANCE, DEVIATIONS
        tolerance, error = tolerances[column - 1], errors[column - 1]
        noise, still = deviations * sqrt(2.0 * scatter / rows), rest + error
        margin = min(margin, 1.0 - moved / (rest + 2.0 * (error + noise)))
        margin = min(margin, 1.0 - scatter / (SCATTER * steps + still * still))
        if tolerance < inf:
            within = tolerance - max(EROSION * tolerance, error, noise)
            margin = min(margin, 1.0 - away / within if within > 0.0 else FAR)
    return margin


# How far a robot and its object are measured off their motion, and what counts as an alarm.
#
# A plan with a budget certifies that nothing departs from its motion by more than D. What a robot measures
# departs by at most D and the noise of one robot. Levels above that are stated in the plan, and the motion
# keeps so much room in its cells that nothing leaves them while no robot measures more, see
# ``robustness/tracking.py``. There are levels of |e|, of |e'|, and of |e + t e'|, where rates take the team
# in the time t until a robot knows of it.
#
# The measurements are raw ones, before predictor, observer and averages, and are compared with the motion at
# their time stamp. The pose of a robot's base is compared with that which the object's pose and the robot's
# joints give, which shows a grasp that slips and a base that is not where its odometry has it.

QUIET_TIME = 0.1
"""A monitor is quiet again when nothing was above its level for so long [s]."""

BRAKING = 2.0
"""So many times its level a departure makes the drives brake [-]: a hold has not stopped it."""

QUIET, ASKS, BRAKES = 0.0, 1.0, 2.0
"""What a monitor says: nothing, that the team be held, or that the drives brake."""

POSITION, VELOCITY, GRASP, TURN, AHEAD = range(5)
"""Levels of the object and the grasp; those of axes follow."""

NAMES = (
    "the object's position",
    "the object's velocity",
    "its grasp",
    "the angle of its base",
    "where the object goes",
)
"""What they are levels of."""


def departing_name(check: int, joints: tuple[str, ...]) -> str:
    """Return what departs the most, by the number of its level, in words.

    Args:
        check: Its number, see ``largest_departure``.
        joints: Names of the robot's joints.
    """
    if check < len(NAMES):
        return NAMES[check]
    axes = ("the object's angle", *joints)
    row, number = divmod(check - len(NAMES), len(axes))
    return ("{}", "the rate of {}", "where {} goes")[row].format(axes[number])


@compiled(borrows=True)
def largest_departure(
    p_LE: FloatArray, mounting: FloatArray, hand: FloatArray, robot: FloatArray, seen: FloatArray,
    led: FloatArray, axes: FloatArray, levels: FloatArray, axis_levels: FloatArray, unseen: float,
) -> tuple[float, int]:  # fmt: skip
    """Return the largest measured departure over its level [-], and the number of this level.

    The first five levels are those above, then come those of all axes (theta, q_k), of their rates, and of
    where both take them.

    Args:
        p_LE: The grasp in L, shape (2,) or longer [m].
        mounting: See ``place_on_axes``, shape (1 + n,).
        hand: Last row of the chain's motion, which ``estimate_object`` has written.
        robot: (z_k, z_k') as measured, shape (2 (3 + n),).
        seen: What ``estimate_object`` makes of it and of the measured pose, shape (6,).
        led: Position and velocity of the motion when this was measured, shape (4,) or longer.
        axes: Axes and their rates then, shape (2, 1 + n) or more rows.
        levels: Of position, velocity, grasp, angle of the base, infinite where there is none, and of where
            the position goes, shape (5,).
        axis_levels: Of the axes, of their rates, and of where both take them, shape (3, 1 + n).
        unseen: t, how far ahead that is [s].
    """
    largest, which, n = 0.0, POSITION, mounting.size - 1
    rx, ry = rotated(cos(seen[2]), sin(seen[2]), p_LE[0], p_LE[1])
    turn = robot[2] - seen[2] - mounting[0]
    for i in range(n):
        turn -= mounting[1 + i] * robot[3 + i]
    e_x, e_y, v_x, v_y = seen[0] - led[0], seen[1] - led[1], seen[3] - led[2], seen[4] - led[3]
    for number in range(5):
        if number == POSITION:
            away = hypot(e_x, e_y)
        elif number == VELOCITY:
            away = hypot(v_x, v_y)
        elif number == AHEAD:
            away = hypot(e_x + unseen * v_x, e_y + unseen * v_y)
        elif number == GRASP:
            away = hypot(robot[0] + hand[PX] - seen[0] - rx, robot[1] + hand[PY] - seen[1] - ry)
        else:
            away = abs(atan2(sin(turn), cos(turn)))
        if away > largest * levels[number]:
            largest, which = away / levels[number], number
    for i in range(axes.shape[1]):
        e = (robot[2 + i] if i > 0 else seen[2]) - axes[0, i]
        v = (robot[5 + n + i] if i > 0 else seen[5]) - axes[1, i]
        for row, off in enumerate((e, v, e + unseen * v)):
            if abs(off) > largest * axis_levels[row, i]:
                largest, which = abs(off) / axis_levels[row, i], 5 + row * axes.shape[1] + i
    return largest, which


@compiled
def alarm_at(share: float, time: float, last: float) -> float:
    """Return what a monitor says.

    Args:
        share: Largest departure over its level now [-].
        time: Now [s].
        last: When one was above its level the last time before [s].
    """
    if share > BRAKING:
        return BRAKES
    return ASKS if share > 1.0 or time - last <= QUIET_TIME else QUIET
