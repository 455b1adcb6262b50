"""The nominal motion of the object's position, which all robots compute alike, and its tracking.

Where a plan has a position tube, p_G does not follow from what is measured. Every robot moves a model of the
object instead, a point p^ behind p_G,

    p^'' = -K (p^ - p_G) - zeta p^',

from sample to sample with p_G at rest in between, and moves p_G by (13)-(16) with p^ in place of p. Nothing
in this depends on measurements, so that all robots have the same numbers, bit by bit. They pull the object to
the nominal motion,

    p'' = p^'' - K_t (p - p^) - zeta_t (p' - p^'),

each with the nominal state of the instant at which its measurements were made.

Why p^ stays in the governed set: let a = root(|p^ - p_G|^2 + |p^'|^2 / K) = root(2 E / K), E being that of
(16). While p_G rests, E' = -zeta |p^'|^2, so that a does not grow. A step of p_G by delta changes a, and the
distance d of p_G to the region's boundary, by at most |delta| each. Steps of at most (d - a) / 2 therefore
keep d - a from becoming negative, and p^, which is within a of p_G, in the region.
"""

from __future__ import annotations

from math import hypot, sqrt

import numpy as np
import scipy  # It imports its parts when they are first used: only this motion needs them.

from coop_drake.jit import compiled
from coop_drake.laws.governor import ATTRACTION_RATE, governed_acceleration, tracking_energy
from coop_drake.tree.pose import FloatArray


def nominal_flow(stiffness: float, damping: float, period: float) -> FloatArray:
    """Return the matrix that carries one coordinate of (p^ - p_G, p^') over a period, shape (2, 2).

    Args:
        stiffness: K [1/s^2].
        damping: zeta [1/s].
        period: T, for which p_G is at rest [s].
    """
    flow: FloatArray = scipy.linalg.expm(period * np.array([[0.0, 1.0], [-stiffness, -damping]]))
    return flow


@compiled
def excursion(x: float, y: float, vx: float, vy: float, stiffness: float) -> float:
    """Return a = root(2 E / K), from which p^ is not farther from p_G until p_G moves [m].

    Args:
        x: First coordinate of p^ - p_G [m].
        y: Second coordinate [m].
        vx: First coordinate of p^' [m/s].
        vy: Second coordinate [m/s].
        stiffness: K [1/s^2].
    """
    return sqrt(2.0 * tracking_energy(x, y, vx, vy, stiffness) / stiffness)


@compiled
def limited_step(vx: float, vy: float, period: float, speed: float, room: float) -> tuple[float, float]:
    """Return the step of p_G in a period, T p_G', no longer than T times a speed and half the room [m].

    Args:
        vx: First coordinate of p_G' of (14) [m/s].
        vy: Second coordinate [m/s].
        period: T [s].
        speed: Largest speed of p_G [m/s].
        room: d - a [m].
    """
    length = period * hypot(vx, vy)
    allowed = min(period * speed, 0.5 * max(room, 0.0))
    scale = period if length <= allowed else period * allowed / length
    return scale * vx, scale * vy


@compiled
def reach_of(distance: float, period: float, periods: float, speed: float) -> float:
    """Return the longest way that p_G can go in some periods [m].

    The field (13) moves p_G by at most ``ATTRACTION_RATE`` times its distance from the target, which with
    every step can grow by as much.

    Args:
        distance: Distance of p_G from the target [m].
        period: T [s].
        periods: Number of periods [-].
        speed: Largest speed of p_G [m/s].
    """
    growth: float = (1.0 + ATTRACTION_RATE * period) ** periods - 1.0
    return min(periods * period * speed, distance * growth)


@compiled(borrows=True)
def tracked_acceleration(
    position: float,
    velocity: float,
    governor_position: float,
    nominal: tuple[float, float],
    expected: tuple[float, float],
    gains: tuple[float, float, float, float],
) -> float:
    """Return one coordinate of the object's desired acceleration: that of p^, and the pull towards it.

    Args:
        position: Coordinate of p as measured [m].
        velocity: The same coordinate of p' as measured [m/s].
        governor_position: The same coordinate of p_G [m].
        nominal: p^ and p^' now [m, m/s].
        expected: p^ and p^' when p and p' were measured [m, m/s].
        gains: K [1/s^2], zeta [1/s], K_t [1/s^2], zeta_t [1/s].
    """
    own = governed_acceleration(nominal[0], nominal[1], governor_position, gains[0], gains[1])
    pull = governed_acceleration(position - expected[0], velocity - expected[1], 0.0, gains[2], gains[3])
    return own + pull
