"""What the robots measure in the simulated team."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context
from pydrake.systems.primitives import Selector

from coop_drake.jit import compiled
from coop_drake.laws.chain_motion import motion_room
from coop_drake.laws.robot_dynamics import read_robot
from coop_drake.plant import SeparateTeam, TeamPlant, base_chain
from coop_drake.systems.block import Block
from coop_drake.systems.selector import build_selector
from coop_drake.tree.pose import FloatArray, IntArray


@compiled(borrows=True)
def _read_team(
    pose: IntArray, first: IntArray, chains: FloatArray, yaws: FloatArray, first_joint: IntArray,
    joints: IntArray, motion: FloatArray, state: FloatArray, measured: FloatArray,
) -> None:  # fmt: skip
    """Write the object's pose, then for every robot what ``read_robot`` writes.

    Args:
        pose: Where the object's pose stands in the state, shape (3,).
        first: Row of ``chains`` with which each robot's begin, and the number of rows, shape (N + 1,).
        chains: From the object to every robot's base.
        yaws: Angles of the bases in the object where all joints are at zero, shape (N,) [rad].
        first_joint: As ``first``, of ``joints``.
        joints: Where all joints stand in the state, then where their rates do, shape (2, n).
        motion: Room for the motion of the longest chain, see ``motion_room``.
        state: State of the team.
        measured: Receives all, shape (3 + 6 N + 2 n,).
    """
    for i in range(3):
        measured[i] = state[pose[i]]
    at = 3
    for k in range(yaws.size):
        own = joints[:, first_joint[k] : first_joint[k + 1]]
        end = at + 2 * (3 + own.shape[1])
        read_robot(chains[first[k] : first[k + 1]], yaws[k], own, motion, state, measured[at:end])
        at = end


class TeamSensor(Block):
    """Reads the object's pose and every robot's own state from a plant whose one tree begins at the object.

    ======= ================ =================== =================================================== =====
    input   ``team_state``   2 (3 + n)           the plant's positions and velocities, its own order
    output  ``measurements`` 3 + sum 2 (3 + n_k) pose of L, then of each robot z_k and its rate,     W
                                                 z_k = (x, y, yaw of Bk, q_k) [m, rad]
    ======= ================ =================== =================================================== =====

    No state. The object's angle and joints are unwrapped; yaws are in (-pi, pi]. All sensors are one block,
    because one call costs less than many; a demultiplexer gives each robot its own part.

    Args:
        team: The team whose plant gives the state.
    """

    def __init__(self, team: TeamPlant) -> None:
        super().__init__()
        chains = [base_chain(team, robot) for robot in team.robots]
        known = (
            team.position_index[:3].astype(np.int64),
            np.array([0, *np.cumsum([len(chain.chain) for chain in chains])]),
            np.vstack([chain.chain for chain in chains]),
            np.array([chain.yaw for chain in chains]),
            np.array([0, *np.cumsum([chain.joints.shape[1] for chain in chains])]),
            np.hstack([chain.joints for chain in chains]),
            max((motion_room(chain.chain) for chain in chains), key=len),
        )
        self._read = partial(_read_team, *known)
        #: Sizes of the measurements' parts: the object's, then each robot's.
        self.sizes = [3, *(2 * (3 + chain.joints.shape[1]) for chain in chains)]
        self._state = self.DeclareVectorInputPort("team_state", team.plant.num_multibody_states())
        self.DeclareVectorOutputPort("measurements", sum(self.sizes), self._write_measurements)

    def _write_measurements(self, context: Context, output: BasicVector) -> None:
        self._read(self._state.Eval(context), output.get_mutable_value())


def build_separate_sensor(team: SeparateTeam) -> Selector:
    """Measures the same in a plant in which every robot is a tree of its own: its state holds all of it.

    ======= ===================== ============== ====================================================== =====
    input   ``team_state``        plant's states the plant's positions and velocities
    output  ``object_pose``       3              pose of L, angle unwrapped [m, rad]                    W
    output  ``robot_<k>_state``   2 (3 + n_k)    z_k and its rate, z_k = (x, y, yaw of Bk, q_k), yaw    W
                                                 unwrapped [m, rad]
    ======= ===================== ============== ====================================================== =====

    Args:
        team: The team whose plant gives the state.
    """
    rates = team.plant.num_positions()
    places = {"object_pose": [int(place) for place in team.position_index[:3]]}
    for robot, base in zip(team.robots, team.base_joints, strict=True):
        places[f"robot_{robot.index}_state"] = [
            *(base.position_start() + i for i in range(3)),
            *(joint.position_start() for joint in robot.joints),
            *(rates + base.velocity_start() + i for i in range(3)),
            *(rates + joint.velocity_start() for joint in robot.joints),
        ]
    return build_selector(
        {"team_state": team.plant.num_multibody_states()},
        {name: [(0, place) for place in chosen] for name, chosen in places.items()},
    )
