"""What the world does to a team beside its actuators, as numbers for a run and as a law of both loops."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray

CREEP_SPEED = 0.01
"""v_c, below which Coulomb friction falls off with the speed [m/s]: small beside the speed of a transport,
and large enough for steps of a millisecond, with a friction of 100 N on a base of 6 kg."""


class WorldDepartures(NamedTuple):
    """The departures of the world in a run, as numbers for N robots.

    Attributes:
        slips: When the wheels of every robot slip from and until, inf for never [s], and the share that is
            lost [-], shape (3, N).
        floor: Coulomb friction [N], viscous friction [N s/m], acceleration of gravity along x [m/s^2], (3,).
        pushes: Of every push the robot whose base is pushed, N for the object, its force [N] and torque
            [N m], begin and end [s], shape (., 6).
        blocked: When the wheels of every robot are blocked from and until, inf for never, shape (2, N) [s].
        friction: Coulomb [N m or N] and viscous friction [N m s or N s/m] of every joint, shape (2,).
    """

    slips: FloatArray
    floor: FloatArray
    pushes: FloatArray
    blocked: FloatArray
    friction: FloatArray


def without_departures(robots: int) -> WorldDepartures:
    """Return a world of N robots in which nothing departs."""
    never = np.full((3, robots), inf)
    return WorldDepartures(never, np.zeros(3), np.empty((0, 6)), never[:2], np.zeros(2))


@compiled(borrows=True)
def act_on_wrenches(
    world: WorldDepartures, instant: float, time: float, velocities: FloatArray, wrenches: FloatArray
) -> None:
    """Turn the wrenches that actuators give into those that bases and object take up.

    Slipping wheels take their share off; then friction of the floor and pushes are added. The floor's force
    on a base is -(f_c / sqrt(|v|^2 + v_c^2) + f_v) v: Coulomb friction made continuous at rest, where the
    force is less than f_c and a push makes the base creep, plus viscous friction.

    Args:
        world: The departures; of its floor only the friction acts here.
        instant: Time at which it is decided whether wheels slip, in the compiled loop that of a sample [s].
        time: Now [s].
        velocities: Of all bases in W, shape (N, 2); read where the floor has friction [m/s].
        wrenches: Those of the bases, and where there are pushes, of the object in row N; they are changed,
            shape (N, 3) or (N + 1, 3) [N, N m].
    """
    slips, floor, pushes = world.slips, world.floor, world.pushes
    for k in range(slips.shape[1]):
        if slips[0, k] <= instant < slips[1, k]:
            for i in range(3):
                wrenches[k, i] *= 1.0 - slips[2, k]
        if floor[0] > 0.0 or floor[1] > 0.0:
            vx, vy = velocities[k, 0], velocities[k, 1]
            factor = -(floor[0] / np.sqrt(vx * vx + vy * vy + CREEP_SPEED * CREEP_SPEED) + floor[1])
            wrenches[k, 0] += factor * vx
            wrenches[k, 1] += factor * vy
    for push in range(pushes.shape[0]):
        if pushes[push, 4] <= time < pushes[push, 5]:
            for i in range(3):
                wrenches[int(pushes[push, 0]), i] += pushes[push, 1 + i]
