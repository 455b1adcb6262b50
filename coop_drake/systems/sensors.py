"""What is measured: the object's pose, and every robot's own state."""

from __future__ import annotations

from math import atan2

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from coop_drake.plant import TeamPlant

__all__ = ["ObjectPoseSensor", "RobotStateSensor"]


class ObjectPoseSensor(LeafSystem):
    """Reads the object's pose.

    ======= ================= ========== ==================================================== =====
    input   ``team_state``    2 (3 + n)  the plant's positions and velocities, its own order
    output  ``object_pose``   3          pose of L in W, angle unwrapped [m, rad]             W
    ======= ================= ========== ==================================================== =====

    No state.

    Args:
        team: The team whose plant gives the state.
    """

    def __init__(self, team: TeamPlant) -> None:
        super().__init__()
        self._index = team.position_index[:3]
        self._team = self.DeclareVectorInputPort("team_state", team.plant.num_multibody_states())
        self.DeclareVectorOutputPort("object_pose", 3, self._write_pose)

    def _write_pose(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._team.Eval(context)[self._index])


class RobotStateSensor(LeafSystem):
    """Reads one robot's own state: where its base is and moves, and its joints.

    ======= ============================ ========== ==================================================== =====
    input   ``team_state``               2 (3 + n)  the plant's positions and velocities, its own order
    output  ``robot_state``              2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)       W
    ======= ============================ ========== ==================================================== =====

    No state. The yaw is in (-pi, pi].

    Args:
        team: The team whose plant gives the state.
        robot: Index k of the robot.

    Raises:
        IndexError: The team has no such robot.
    """

    def __init__(self, team: TeamPlant, robot: int) -> None:
        super().__init__()
        if not 0 <= robot < len(team.robots):
            raise IndexError(f"robot {robot} is not in the team of {len(team.robots)}")
        model = team.robots[robot]
        self._plant, self._base = team.plant, model.base_body
        # Kinematics of this context cost a tenth of reading the plant's poses of all bodies as a list.
        self._scratch = team.plant.CreateDefaultContext()
        in_q = slice(3 + model.q_slice.start, 3 + model.q_slice.stop)
        self._positions = team.position_index[in_q]
        self._rates = team.plant.num_positions() + team.velocity_index[in_q]
        self._team = self.DeclareVectorInputPort("team_state", team.plant.num_multibody_states())
        self.DeclareVectorOutputPort("robot_state", 2 * (3 + len(model.joints)), self._write_state)

    def _write_state(self, context: Context, output: BasicVector) -> None:
        team = self._team.Eval(context)
        self._plant.SetPositionsAndVelocities(self._scratch, team)
        X = self._base.EvalPoseInWorld(self._scratch).GetAsMatrix34()
        V = self._base.EvalSpatialVelocityInWorld(self._scratch).get_coeffs()
        base, base_rate = (X[0, 3], X[1, 3], atan2(X[1, 0], X[0, 0])), (V[3], V[4], V[2])
        output.SetFromVector(np.concatenate([base, team[self._positions], base_rate, team[self._rates]]))
