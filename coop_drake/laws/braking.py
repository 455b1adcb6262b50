"""How a robot stops by itself when its team is not complete: every effort works against its own rate."""

import numpy as np

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


def braking_damping(mass: float, inertia: float, joints: int) -> FloatArray:
    """Return base wrench and joint torques for each unit of the rates, shape (3 + n,).

    Args:
        mass: Mass of the base [kg].
        inertia: Its inertia about the vertical axis through the origin of Bk [kg m^2].
        joints: Number n of joints.
    """
    return np.array([BASE_RATE * mass, BASE_RATE * mass, TURN_RATE * inertia, *[JOINT_DAMPING] * joints])


def braking_effort(state: FloatArray, damping: FloatArray) -> FloatArray:
    """Return base wrench and joint torques that brake a robot, shape (3 + n,) [N, N m].

    Its power is negative whatever the others do, but for the age of measurements, so that a team in which
    all robots brake comes to rest.

    Args:
        state: z_k and its rate, shape (2 (3 + n),).
        damping: From :func:`braking_damping`.
    """
    return -damping * state[len(state) // 2 :]
