"""How much the axes of a team accelerate each other: by disagreement of robots, and by rates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.team_dynamics import TeamWork, frames_of, team_accelerations, team_chain, team_work
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import Bodies, ComponentTree

# How much robots that disagree about the acceleration of the object accelerate the axes.


def disagreement_coupling(
    tree: ComponentTree, moved: Bodies, rotors: Sequence[float], joints: FloatArray
) -> FloatArray:
    """Return by how much the axes (theta, q...) are accelerated because robots push with other accelerations.

    Robot k presses all that it moves with its mass times the acceleration of the object's origin that it
    commands. Where all command the same, the axes do not move: W_k, the acceleration of an axis for a unit
    of robot k's command alone, has the sum zero over all robots. Errors of several robots rarely add up, so
    that the result is the root of the sum of the squares of all W_k, along x and y.

    Args:
        tree: The team.
        moved: The bodies with the robots that move them, robot by robot, the object's with their shares.
        rotors: Inertia that its rotor adds to every joint, shape (n,), or empty for none [kg m^2 or kg].
        joints: Configurations of the joints, shape (configurations, n) [rad or m].

    Returns:
        The acceleration of each axis over that by which each robot's command departs from that of all, shape
        (configurations, 1 + n) [rad/m, or - for a joint that slides].
    """
    frames, chain = frames_of(tree), team_chain(tree, moved, rotors)
    owners, links = (np.array([int(body[i]) for body in moved]) for i in (5, 0))
    places = np.array([frames[int(body[0])].apply(np.array(body[2:4])) for body in moved])
    masses = np.array([body[1] for body in moved])
    wrenches = np.zeros((int(owners.max()) + 1, 2, len(masses), 3))
    for k, own in enumerate(wrenches):
        own[0, :, 0] = own[1, :, 1] = np.where(owners == k, masses, 0.0)
    states = _at_rest(joints)
    pushes = wrenches.reshape(-1, *wrenches.shape[2:])
    found = _accelerations(chain, links, places, pushes, states, team_work(chain))
    coupling: FloatArray = np.sqrt((found[:, :, 2:] ** 2).sum(axis=1))
    return coupling


def _at_rest(joints: FloatArray) -> FloatArray:
    """Return states of a team that ``team_accelerations`` takes, at configurations of its joints.

    Args:
        joints: The configurations, shape (configurations, n) [rad or m].

    Returns:
        (z, z') with the object at the origin and all rates zero, shape (configurations, 2 (3 + n)).
    """
    states = np.zeros((len(joints), 2 * (3 + joints.shape[1])))
    states[:, 3 : 3 + joints.shape[1]] = joints
    return states


@compiled
def _accelerations(
    chain: FloatArray,
    links: IntArray,
    places: FloatArray,
    wrenches: FloatArray,
    states: FloatArray,
    work: TeamWork,
) -> FloatArray:
    """Return the accelerations of a team without efforts for all states under all wrenches.

    Args:
        chain: The team, of the form that ``team_accelerations`` takes.
        links: The links that are pushed, shape (m,).
        places: Where, in the plane of the object's frame with all joints at zero, shape (m, 2) [m].
        wrenches: Shape (w, m, 3) [N, N m].
        states: (z, z'), shape (s, 2 (3 + n)) [m, rad, and per second].
        work: Room.

    Returns:
        z'', shape (s, w, 3 + n) [m/s^2, rad/s^2].
    """
    n = states.shape[1] // 2
    efforts, found = np.zeros(n), np.empty((states.shape[0], wrenches.shape[0], n))
    for s in range(states.shape[0]):
        for w in range(wrenches.shape[0]):
            team_accelerations(chain, links, places, wrenches[w], efforts, 0.0, states[s], work, found[s, w])
    return found


# Centripetal and Coriolis terms: how much the rates of a team's axes accelerate them by themselves.


AT_A_TIME = 100
"""Configurations whose states are in memory at the same time [-]: 24 joints have 325 pairs of rates."""


def rate_terms(
    tree: ComponentTree, bodies: Bodies, rotors: Sequence[float], joints: FloatArray
) -> FloatArray:
    """Return how much pairs of rates accelerate the axes (theta, q...) where nothing is commanded.

    The acceleration of axis i is -(M^-1 C)_i, the sum over j and k <= j of a coefficient times w_j w_k. These
    coefficients do not depend on the object's pose.

    Args:
        tree: The team.
        bodies: All bodies.
        rotors: Inertia that its rotor adds to every joint, shape (n,), or empty for none [kg m^2 or kg].
        joints: Configurations of the joints, shape (configurations, n) [rad or m].

    Returns:
        Sizes of the coefficients, [..., i, j, k], zero for k > j, shape (configurations, axes, axes, axes).
    """
    chain, axes = team_chain(tree, bodies, rotors), 1 + joints.shape[1]
    nothing, nowhere = np.empty(0, dtype=np.int64), np.empty((0, 2))
    pairs = np.array([(j, k) for j in range(axes) for k in range(j + 1)])
    coefficients = np.zeros((len(joints), axes, axes, axes))
    for begin in range(0, len(joints), AT_A_TIME):
        part = coefficients[begin : begin + AT_A_TIME]
        states = np.repeat(_at_rest(joints[begin : begin + AT_A_TIME])[:, None], len(pairs), axis=1)
        for state, pair in zip(states.swapaxes(0, 1), pairs, strict=True):
            state[:, 4 + axes + pair] = 1.0
        rows = states.reshape(-1, states.shape[2])
        found = _accelerations(chain, nothing, nowhere, np.empty((1, 0, 3)), rows, team_work(chain))
        found = found.reshape(*states.shape[:2], -1)[:, :, 2:]
        own = found[:, pairs[:, 0] == pairs[:, 1]]
        for number, (j, k) in enumerate(pairs):
            both = found[:, number]
            part[:, :, j, k] = np.abs(both if j == k else both - own[:, j] - own[:, k])
    return coefficients
