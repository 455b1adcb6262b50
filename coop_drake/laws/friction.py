"""Friction of a base on the floor."""

import numpy as np

from coop_drake.jit import compiled

CREEP_SPEED = 0.01
"""Speed below which Coulomb friction falls off with the speed [m/s]: small beside the speed of a transport,
and large enough for steps of a millisecond, with a friction of 100 N on a base of 6 kg."""


@compiled
def base_friction(vx: float, vy: float, coulomb: float, viscous: float) -> tuple[float, float]:
    """Return the force of the floor on a base, -(f_c / sqrt(|v|^2 + v_c^2) + f_v) v [N].

    This is Coulomb friction made continuous at rest, where the force is less than f_c and a push makes the
    base creep, plus viscous friction.

    Args:
        vx: First coordinate of the base's velocity in W [m/s].
        vy: Second coordinate [m/s].
        coulomb: f_c, the friction force at any speed well above v_c, ``CREEP_SPEED`` [N].
        viscous: f_v, friction force for each unit of speed [N s/m].
    """
    factor = -(coulomb / np.sqrt(vx * vx + vy * vy + CREEP_SPEED * CREEP_SPEED) + viscous)
    return factor * vx, factor * vy
