"""How a robot stops by itself when its team is not complete: every effort works against its own rate."""

import numpy as np

from coop_drake.tree.pose import FloatArray

BASE_DAMPING = 100.0
"""Force on a base for each unit of its speed [N s/m]: bases of 6 kg with their loads stop within 0.3 s, and
efforts that are held for 5 ms and rest on measurements of 10 ms ago still take energy away."""

TURN_DAMPING = 1.0
"""Torque on a base for each unit of its turn rate [N m s/rad]. A larger one would, with measurements as
old, add energy to links of less than 0.1 kg m^2, as the elbows' are."""

JOINT_DAMPING = 1.0
"""Effort of a joint for each unit of its rate [N m s/rad or N s/m], see ``TURN_DAMPING``."""


def braking_effort(state: FloatArray) -> FloatArray:
    """Return base wrench and joint torques that brake a robot, shape (3 + n,) [N, N m].

    Its power is negative whatever the others do, but for the age of measurements, so that a team in which
    all robots brake comes to rest.

    Args:
        state: z_k and its rate, shape (2 (3 + n),).
    """
    rates = state[len(state) // 2 :]
    joints = np.full(len(rates) - 3, JOINT_DAMPING)
    return -np.concatenate([[BASE_DAMPING, BASE_DAMPING, TURN_DAMPING], joints]) * rates
