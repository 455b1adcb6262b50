"""The actuator forces that give one robot's end effector and joints the accelerations asked for."""

from __future__ import annotations

from functools import partial

from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.chain_motion import motion_room
from coop_drake.laws.robot_dynamics import robot_effort
from coop_drake.plant import RobotPlant, robot_chain
from coop_drake.systems.block import Block


class RobotEffort(Block):
    """Actuation M z'' + C z' + G + J^T tau_e of one robot from its own model, state and commands: (22)-(34).

    ======= ======================== ========== ======================================================= =====
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)          W
    input   ``hand_command``         6          acceleration of Ek wanted [m/s^2, rad/s^2],
                                                then the wrench on the object at Ek [N, N m]            W
    input   ``axis_acceleration``    1 + n      acceleration of the object's angle, not used here; those
                                                of the joints wanted [rad/s^2 or m/s^2]
    output  ``robot_effort``         3 + n      base wrench at Bk, joint torques [N, N m]               W
    ======= ======================== ========== ======================================================= =====

    No state.

    Args:
        robot: The robot's model of itself; only its scratch context changes.
    """

    def __init__(self, robot: RobotPlant) -> None:
        super().__init__()
        self._robot, self._springs = robot, robot.has_springs
        chain = robot_chain(robot)
        self._effort = partial(robot_effort, chain, motion_room(chain))
        self._size = size = 3 + len(robot.joints)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * size)
        self._hand = self.DeclareVectorInputPort("hand_command", 6)
        self._axes = self.DeclareVectorInputPort("axis_acceleration", size - 2)
        self.DeclareVectorOutputPort("robot_effort", size, self._write_effort)

    def _write_effort(self, context: Context, output: BasicVector) -> None:
        state, effort = self._state.Eval(context), output.get_mutable_value()
        self._effort(state, self._hand.Eval(context), self._axes.Eval(context), effort)
        if self._springs:
            self._robot.set_state(state[: self._size], state[self._size :])
            effort += self._robot.spring_effort()
