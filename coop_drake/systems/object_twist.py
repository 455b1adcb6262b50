"""The object's velocity as one robot knows it: from its own motion alone."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from coop_drake.control.load_sharing import object_twist, rotate
from coop_drake.geometry.pose import FloatArray
from coop_drake.plant import RobotPlant

__all__ = ["ObjectTwist"]


class ObjectTwist(LeafSystem):
    """The object's twist A_k^-1 J_k z_k' through the rigid grasp, (27); no other robot's state is needed.

    ======= ================= ========== ===================================================== =====
    input   ``robot_state``   2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)        W
    input   ``object_pose``   3          pose of L in W [m, rad]                               W
    output  ``object_twist``  3          velocity of L's origin, angular rate [m/s, rad/s]     W
    ======= ================= ========== ===================================================== =====

    No state.

    Args:
        robot: The robot's model of itself; only its scratch context changes.
        p_LE: The grasp in L, shape (2,) [m].
    """

    def __init__(self, robot: RobotPlant, p_LE: FloatArray) -> None:
        super().__init__()
        self._robot, self._p_LE = robot, np.array(p_LE, dtype=float)
        self._size = 3 + len(robot.joints)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * self._size)
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self.DeclareVectorOutputPort("object_twist", 3, self._write_twist)

    def _write_twist(self, context: Context, output: BasicVector) -> None:
        state, theta = self._state.Eval(context), self._pose.Eval(context)[2]
        self._robot.set_state(state[: self._size], state[self._size :])
        V_WE = self._robot.gripper_frame.CalcSpatialVelocityInWorld(self._robot.context)
        (vx, vy, _), (_, _, w) = V_WE.translational(), V_WE.rotational()
        output.SetFromVector(object_twist(rotate(theta, self._p_LE), (vx, vy, w)))
