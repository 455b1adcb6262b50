"""What is measured: the object's pose, and every robot's own state."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context

from coop_drake.control.planar_chain import read_robot
from coop_drake.plant import TeamPlant, base_chain
from coop_drake.systems.block import Block

__all__ = ["ObjectPoseSensor", "RobotStateSensor"]


class ObjectPoseSensor(Block):
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


class RobotStateSensor(Block):
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
        way = base_chain(team, team.robots[robot])
        self._way = way.chain, way.yaw, way.joints
        self._team = self.DeclareVectorInputPort("team_state", team.plant.num_multibody_states())
        self.DeclareVectorOutputPort("robot_state", 2 * (3 + way.joints.shape[1]), self._write_state)

    def _write_state(self, context: Context, output: BasicVector) -> None:
        read_robot(*self._way, self._team.Eval(context), output.get_mutable_value())
