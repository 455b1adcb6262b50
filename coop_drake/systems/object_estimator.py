"""The object's state as one robot knows it: the measured pose, and the velocity from its own motion."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.chain_motion import motion_room
from coop_drake.laws.robot_dynamics import estimate_object
from coop_drake.plant import RobotPlant, robot_chain
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


class ObjectEstimator(Block):
    """Joins the object's pose with its twist A_k^-1 J_k z_k' from the robot's own motion: (27) and (29).

    ======= ================= ========== ===================================================== =====
    input   ``robot_state``   2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)        W
    input   ``object_pose``   3          pose of L, angle unwrapped [m, rad]                   W
    output  ``object_state``  6          that pose, velocity of L's origin, angular rate       W
    ======= ================= ========== ===================================================== =====

    No state. No other robot's state is needed.

    Args:
        robot: The robot's model of itself.
        p_LE: The grasp in L, shape (2,) [m].
    """

    def __init__(self, robot: RobotPlant, p_LE: FloatArray) -> None:
        super().__init__()
        chain = robot_chain(robot)
        known = chain, np.array(p_LE, dtype=float), motion_room(chain)
        self._estimate = partial(estimate_object, *known)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * (3 + len(robot.joints)))
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self.DeclareVectorOutputPort("object_state", 6, self._write_state)

    def _write_state(self, context: Context, output: BasicVector) -> None:
        self._estimate(self._state.Eval(context), self._pose.Eval(context), output.get_mutable_value())
