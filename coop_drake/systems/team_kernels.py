"""The models of all robots as arrays, and what each of them measures of itself."""

from __future__ import annotations

from typing import NamedTuple

from coop_drake.jit import compiled
from coop_drake.laws.robot_dynamics import read_robot
from coop_drake.tree.pose import FloatArray, IntArray


class FusedTeam(NamedTuple):
    """The robots, their tables stacked; row ``first[i, k]`` of a stack is the first one of robot k.

    Attributes:
        places: Where z, then its rates stand in the plant's state, shape (2, 3 + n).
        first: First rows in ``chains`` and in ``base_chains``, first joint, shape (3, N + 1).
        chains: From every robot's base to its end effector.
        base_chains: From the object to every robot's base.
        yaws: Angle of every base in the object where all joints are at zero, shape (N,) [rad].
        loads: What ``end_effector_command`` takes of every robot, shape (N, 7).
        tracking: K, zeta, K_t and zeta_t where the position tracks a nominal motion, else of shape (0,).
    """

    places: IntArray
    first: IntArray
    chains: FloatArray
    base_chains: FloatArray
    yaws: FloatArray
    loads: FloatArray
    tracking: FloatArray


@compiled(borrows=True)
def read_own(
    k: int,
    places: IntArray,
    first: IntArray,
    base_chains: FloatArray,
    yaws: FloatArray,
    motion: FloatArray,
    state: FloatArray,
    robot: FloatArray,
) -> None:
    """Write (z_k, z_k') of robot k, see ``read_robot``; ``motion`` is room for the longest chain's motion."""
    joints = places[:, 3 + first[2, k] : 3 + first[2, k + 1]]
    read_robot(base_chains[first[1, k] : first[1, k + 1]], yaws[k], joints, motion, state, robot)
