"""How a robot stops by itself when its team is not complete: every effort works against its own rate.

Where a robot has told its drives a rest, they pull towards it, too, z being the robot's own coordinates:

    effort = -D (z' + kappa (z - z_rest)).

Damper and spring take energy out of the team whatever its masses are, for -D z' has negative power and the
spring has a potential. All robots follow the same nominal motion and so name rests that fit each other: the
team comes to rest where this motion was, which is inside its cell.

Drives that are limited cut the damper's part and the spring's part to half of each limit, so that their sum
is never beyond it. Cut by itself, the damper still has negative power, and the spring a potential.
"""

from math import pi, tau
from typing import NamedTuple

import numpy as np

from coop_drake.laws.actuators import limit_efforts
from coop_drake.tree.pose import FloatArray

BASE_RATE = 100.0 / 6.0
"""Force on a base for each unit of its momentum [1/s]: it would stop alone within 0.2 s, with its load within
0.3 s, and efforts that are held for 5 ms and rest on measurements of 10 ms ago still take energy away."""

TURN_RATE = 1.0 / 0.1875
"""Torque on a base for each unit of its own angular momentum [1/s]. A larger one would, with measurements as
old, add energy to arms that turn with a base and have less inertia, as the elbows' have."""

JOINT_DAMPING = 1.0
"""Effort of a joint for each unit of its rate [N m s/rad or N s/m], for links from 0.1 kg m^2 or kg on with
measurements as old; lighter ones need fresher measurements."""


RETURN_RATE = 4.0
"""kappa [1/s]: a team of bases of 6 kg with their load, whose damping is 12 /s, overshoots its rest by less
than it would coast."""


class Brake(NamedTuple):
    """How the drives of one robot brake.

    Attributes:
        damping: D, from :func:`braking_damping`, shape (3 + n,).
        limits: Largest length of the base's force, largest torque and largest efforts of the joints, infinite
            for none, shape (2 + n,) [N, N m].
    """

    damping: FloatArray
    limits: FloatArray


def braking_damping(mass: float, inertia: float, joints: int) -> FloatArray:
    """Return base wrench and joint torques for each unit of the rates, shape (3 + n,).

    Args:
        mass: Mass of the base [kg].
        inertia: Its inertia about the vertical axis through the origin of Bk [kg m^2].
        joints: Number n of joints.
    """
    return np.array([BASE_RATE * mass, BASE_RATE * mass, TURN_RATE * inertia, *[JOINT_DAMPING] * joints])


def braking_effort(state: FloatArray, brake: Brake, rest: FloatArray | None = None) -> FloatArray:
    """Return base wrench and joint torques that brake a robot, within its limits, shape (3 + n,) [N, N m].

    A team in which all robots brake loses energy, but for the age of measurements, and comes to rest.

    Args:
        state: z_k and its rate, shape (2 (3 + n),).
        brake: How its drives brake.
        rest: Where it shall come to rest, z_k of shape (3 + n,); None where that is not known.
    """
    half, halved = len(state) // 2, 0.5 * brake.limits
    effort = -brake.damping * state[half:]
    limit_efforts(halved, effort)
    if rest is None:
        return effort
    away = state[:half] - rest
    away[2:] = (away[2:] + pi) % tau - pi  # a rest is never half a turn away; sensors may show any turn
    pull = -RETURN_RATE * brake.damping * away
    limit_efforts(halved, pull)
    return effort + pull
