"""What one robot's actuators do to give its hand and its joints the accelerations asked for."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from coop_drake.control.robot_effort import robot_acceleration
from coop_drake.plant import RobotPlant

__all__ = ["RobotEffort"]


class RobotEffort(LeafSystem):
    """Actuation M z'' + C z' + G + J^T tau_e of one robot from its own model, state and commands: (22)-(34).

    ======= ======================== ========== ======================================================= =====
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)          W
    input   ``hand_command``         6          acceleration of Ek wanted [m/s^2, rad/s^2],
                                                then the wrench on the object at Ek [N, N m]            W
    input   ``joint_acceleration``   n          accelerations of the joints wanted [rad/s^2 or m/s^2]
    output  ``robot_effort``         3 + n      base wrench at Bk, joint torques [N, N m]               W
    ======= ======================== ========== ======================================================= =====

    No state.

    Args:
        robot: The robot's model of itself; only its scratch context changes.
    """

    def __init__(self, robot: RobotPlant) -> None:
        super().__init__()
        self._robot = robot
        self._size = 3 + len(robot.joints)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * self._size)
        self._hand = self.DeclareVectorInputPort("hand_command", 6)
        self._joints = self.DeclareVectorInputPort("joint_acceleration", self._size - 3)
        self.DeclareVectorOutputPort("robot_effort", self._size, self._write_effort)

    def _write_effort(self, context: Context, output: BasicVector) -> None:
        # Inputs first: evaluating them may move the shared scratch context.
        state, hand = self._state.Eval(context), self._hand.Eval(context)
        joints, robot = self._joints.Eval(context), self._robot
        robot.set_state(state[: self._size], state[self._size :])
        jacobian = robot.grasp_jacobian()
        acceleration = robot_acceleration(
            hand[:3], joints, jacobian=jacobian, jacobian_rate_term=robot.grasp_bias()
        )
        output.SetFromVector(robot.inertial_effort(acceleration) + hand[3:] @ jacobian)
