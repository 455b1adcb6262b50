"""How much the axes of a team accelerate each other: by disagreement of robots, and by rates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.team_dynamics import TeamWork, frames_of, team_accelerations, team_chain, team_work
from coop_drake.tree.component_tree import Bodies, ComponentTree
from coop_drake.tree.pose import FloatArray, IntArray

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
    squares = np.zeros((len(joints), 1 + joints.shape[1]))
    configurations = np.ascontiguousarray(joints)
    _add_squares(chain, (owners, links), places, masses, configurations, team_work(chain), squares)
    coupling: FloatArray = np.sqrt(squares)
    return coupling


@compiled
def _add_squares(
    chain: FloatArray,
    of_bodies: tuple[IntArray, IntArray],
    places: FloatArray,
    masses: FloatArray,
    joints: FloatArray,
    work: TeamWork,
    squares: FloatArray,
) -> None:
    """Add the squares of W_k along x and y for all robots k.

    Args:
        chain: The team, of the form that ``team_accelerations`` takes.
        of_bodies: The robot, in ascending order, and the link of every body, shape (bodies,) each.
        places: Their centres of mass, in the plane of the object's frame with all joints at zero, shape
            (bodies, 2) [m].
        masses: Their masses, shape (bodies,) [kg].
        joints: Configurations, shape (configurations, n) [rad or m].
        work: Room.
        squares: Receives the sums, shape (configurations, 1 + n) [rad^2/m^2 or -].
    """
    owners, links = of_bodies
    n = joints.shape[1] + 3
    state, efforts = np.zeros(2 * n), np.zeros(n)
    found, wrenches = np.empty(n), np.zeros((masses.size, 3))
    for c in range(joints.shape[0]):
        state[3:n] = joints[c]
        for robot in range(owners[-1] + 1):
            for direction in range(2):
                for b in range(masses.size):
                    wrenches[b] = 0.0
                    wrenches[b, direction] = masses[b] if owners[b] == robot else 0.0
                team_accelerations(chain, links, places, wrenches, efforts, 0.0, state, work, found)
                squares[c] += found[2:] ** 2


# Centripetal and Coriolis terms: how much the rates of a team's axes accelerate them by themselves.


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
    coefficients = np.zeros((len(joints), axes, axes, axes))
    _write_coefficients(chain, np.ascontiguousarray(joints), team_work(chain), coefficients)
    return coefficients


@compiled
def _write_coefficients(
    chain: FloatArray, joints: FloatArray, work: TeamWork, coefficients: FloatArray
) -> None:
    """Write the sizes of all coefficients, by the accelerations at unit rates of one axis and of two."""
    axes = joints.shape[1] + 1
    n = axes + 2
    state, efforts, own, found = np.zeros(2 * n), np.zeros(n), np.empty((axes, axes)), np.empty(n)
    nothing, nowhere = np.empty(0, dtype=np.int64), np.empty((0, 3))
    for c in range(joints.shape[0]):
        state[3:n] = joints[c]
        for j in range(axes):
            for k in range(j, -1, -1):  # Axis j alone comes first, then with every axis before it.
                state[n:] = 0.0
                state[n + 2 + j] = state[n + 2 + k] = 1.0
                team_accelerations(chain, nothing, nowhere, nowhere, efforts, 0.0, state, work, found)
                for i in range(axes):
                    if k == j:
                        own[j, i] = found[2 + i]
                        coefficients[c, i, j, j] = abs(own[j, i])
                    else:
                        coefficients[c, i, j, k] = abs(found[2 + i] - own[j, i] - own[k, i])
