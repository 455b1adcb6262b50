"""What one robot measures of itself where its base moves on a joint of its own."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.plant import SeparateTeam
from coop_drake.systems.block import Block

__all__ = ["FreeRobotSensor"]


class FreeRobotSensor(Block):
    """Reads one robot's own state from a plant in which it is a tree of its own.

    ======= ============================ =============== =============================================== =====
    input   ``team_state``               plant's states  the plant's positions and velocities
    output  ``robot_state``              2 (3 + n)       z_k and its rate, z_k = (x, y, yaw of Bk, q_k)  W
    ======= ============================ =============== =============================================== =====

    No state. The yaw is unwrapped.

    Args:
        team: The team whose plant gives the state.
        robot: Index k of the robot.

    Raises:
        IndexError: The team has no such robot.
    """

    def __init__(self, team: SeparateTeam, robot: int) -> None:
        super().__init__()
        if not 0 <= robot < len(team.robots):
            raise IndexError(f"robot {robot} is not in the team of {len(team.robots)}")
        base, joints = team.base_joints[robot], team.robots[robot].joints
        rates = team.plant.num_positions()
        self._index = np.array(
            [
                *(base.position_start() + np.arange(3)),
                *(joint.position_start() for joint in joints),
                *(rates + base.velocity_start() + np.arange(3)),
                *(rates + joint.velocity_start() for joint in joints),
            ]
        )
        self._team = self.DeclareVectorInputPort("team_state", team.plant.num_multibody_states())
        self.DeclareVectorOutputPort("robot_state", len(self._index), self._write_state)

    def _write_state(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._team.Eval(context)[self._index])
