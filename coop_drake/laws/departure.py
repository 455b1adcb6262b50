"""How far a robot and its object are measured off their nominal motion, and what counts as an alarm.

A plan with a budget certifies that nothing departs from its nominal motion by more than D. What a robot
measures departs by at most D and the noise of one robot, n_1. The plan therefore states levels a >= D + n_1,
above which something is wrong that the budget does not count. While no robot measures more, nothing departs
by more than a + n_2, n_2 being the noise that is left where all robots judge: for what they all measure, that
of their mean. So it was when the measurements were made. Until a report is used that rests on them, the time

    t = delay + s + report_age + T

passes, s being by how much the age of measurements may be wrong, in which a departure whose rate the noise of
rates hides grows by at most n_v t + w t^2 / 2. The plan leaves room for all of it: the strip between the
governed sets and their cells is at least a + n_2 + growth wide, and the level of an axis is never more than
what its nominal distance d^ to its funnel's bounds leaves, min(a, d^ - n_2 - growth). With a wrong age, n_1
and n_2 hold s times the largest rate, too, for rates s times the largest acceleration.

The measurements are raw ones, before predictor, observer and averages, and are compared with the nominal
state of the instant at which they were made. The pose of a robot's base is compared with that which the
object's pose and the robot's joints give, which shows a grasp that slips and a base that is not where its
odometry has it.
"""

from __future__ import annotations

from math import atan2, cos, hypot, inf, sin

from coop_drake.jit import compiled
from coop_drake.laws.chain_motion import PX, PY, write_motion
from coop_drake.laws.load_sharing import rotated
from coop_drake.laws.sampling import whole_periods
from coop_drake.tree.pose import FloatArray

QUIET_TIME = 0.1
"""A monitor is quiet again when nothing was above its level for so long [s]."""

BRAKING = 2.0
"""So many times its level a departure makes the drives brake [-]: a hold has not stopped it."""

QUIET, ASKS, BRAKES = 0.0, 1.0, 2.0
"""What a monitor says: nothing, that the team be held, or that the drives brake."""

POSITION, VELOCITY, GRASP, TURN, AHEAD = range(5)
"""Levels that all transitions of a plan have in common."""

NAMES = (
    "the object's position",
    "the object's velocity",
    "its grasp",
    "the angle of its base",
    "where the object goes",
)
"""What they are levels of."""


def unseen_time(delay: float, report_age: float, period: float, age_error: float) -> float:
    """Return t, how long a departure may grow until a report is used no more that does not know of it [s].

    Args:
        delay: Age of the measurements [s].
        report_age: How long a report may be used [s].
        period: T [s].
        age_error: By how much older the measurements may be [s].
    """
    return (whole_periods(delay, period) + whole_periods(report_age, period) + 1) * period + age_error


def growth(rate_noise: float, error: float, time: float) -> float:
    """Return by how much a departure grows in a time whose rate the noise hides [m or rad].

    Args:
        rate_noise: n_v [m/s or rad/s].
        error: w, largest acceleration that the budget allows besides the model's error [m/s^2 or rad/s^2].
        time: t [s].
    """
    return time * (rate_noise + 0.5 * error * time)


def departing_name(check: int, joints: tuple[str, ...]) -> str:
    """Return what departs the most, by the number of its level, in words.

    Args:
        check: Its number, see ``largest_departure``.
        joints: Names of the robot's joints.
    """
    if check < len(NAMES):
        return NAMES[check]
    axes = ("the object's angle", *joints)
    number = check - len(NAMES)
    return axes[number] if number < len(axes) else f"the rate of {axes[number - len(axes)]}"


@compiled
def axis_level(alarm: float, reserve: float, position: float, lower: float, upper: float) -> float:
    """Return the level of an axis at an instant: what its plan states, or what its room leaves [rad or m].

    Args:
        alarm: a [rad or m].
        reserve: n_2 and the growth [rad or m].
        position: x^, the nominal position [rad or m].
        lower: Lower bound of its funnel [rad or m].
        upper: Upper bound [rad or m].
    """
    return min(alarm, min(position - lower, upper - position) - reserve)


@compiled(borrows=True)
def largest_departure(
    chain: FloatArray, p_LE: FloatArray, mounting: FloatArray, motion: FloatArray, robot: FloatArray,
    seen: FloatArray, led: FloatArray, axes: FloatArray, levels: FloatArray, axis_levels: FloatArray,
    unseen: float,
) -> tuple[float, int]:  # fmt: skip
    """Return the largest measured departure over its level [-], and the number of this level.

    The first five levels are those above, then come those of all axes (theta, q_k), then those of their
    rates. An axis whose level is not positive departs infinitely.

    Args:
        chain: From the robot's base to its end effector.
        p_LE: The grasp in L, shape (2,) or longer [m].
        mounting: See ``place_on_axes``, shape (1 + n,).
        motion: Room for the chain's motion, see ``motion_room``.
        robot: (z_k, z_k') as measured, shape (2 (3 + n),).
        seen: What ``estimate_object`` makes of it and of the measured pose, shape (6,).
        led: p^ and p^' when this was measured, shape (4,) or longer.
        axes: x^ and x^' then, shape (2, 1 + n) or more rows; shape (2, 0) where they have no nominal motion.
        levels: Of position, velocity, grasp, angle of the base, infinite where there is none, and of where
            the position goes, shape (5,).
        axis_levels: Of the axes then, and of their rates, of the shape of ``axes``.
        unseen: t, how far ahead that is [s].
    """
    largest, which, n = 0.0, POSITION, mounting.size - 1
    last = chain.shape[0] - 1
    write_motion(chain, robot, motion)
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
            slipped_x = robot[0] + motion[last, PX] - seen[0] - rx
            away = hypot(slipped_x, robot[1] + motion[last, PY] - seen[1] - ry)
        else:
            away = abs(atan2(sin(turn), cos(turn)))
        if away > largest * levels[number]:
            largest, which = away / levels[number], number
    for row in range(2 if axes.size else 0):
        for i in range(axes.shape[1]):
            measured = seen[2 + 3 * row]
            if i > 0:
                measured = robot[2 + i] if row == 0 else robot[5 + n + i]
            away, level = abs(measured - axes[row, i]), axis_levels[row, i]
            share = away / level if level > 0.0 else inf
            if share > largest:
                largest, which = share, 5 + row * axes.shape[1] + i
    return largest, which


@compiled
def quiet_margin(margin: float, alarm: float) -> float:
    """Return the margin with which a robot is ready: less than zero where its monitor is not quiet [-]."""
    return min(margin, -1.0) if alarm > QUIET else margin


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
