"""A robot's prediction of the present from delayed measurements and its own commands."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from coop_drake.laws.prediction import predict, wanted_accelerations
from coop_drake.plant import RobotPlant, robot_chain
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


class StatePredictor(Block):
    """Integrates a robot's own commands over the known delay of its measurements; no message is needed.

    The law gives the object, the base and the joints the accelerations that it asks for; robots that follow
    one plan ask for the same motion of the object. The prediction errs by what the commands do not contain:
    errors of the model, disturbances, and what other robots want otherwise.

    ======= ====================== ========== ====================================================== =====
    input   ``robot_state``        2 (3 + n)  z_k and its rate, as they were ``periods`` ago         W
    input   ``object_pose``        3          pose of L, of the same age                             W
    input   ``governor_command``   4          rate of p_G, not used here; acceleration wanted for L  W
    input   ``axis_acceleration``  1 + n      accelerations wanted for the object's angle and joints W
    output  ``predicted_state``    2 (3 + n)  z_k and its rate now                                   W
    output  ``predicted_pose``     3          pose of L now                                          W
    ======= ====================== ========== ====================================================== =====

    State: one discrete group, updated every ``period``: the accelerations of the object (3), of the base (3)
    and of the joints (n) in each of the last ``periods`` periods, the oldest first.

    Args:
        robot: The robot's model of itself.
        load: Its load, as ``end_effector_command`` takes it, shape (7,); the grasp in L first.
        periods: Age of the measurements, in control periods.
        period: Control period [s].
        offset: Time of the first sample [s].

    Raises:
        ValueError: There is no delay, or the period is not positive.
    """

    def __init__(
        self, robot: RobotPlant, load: FloatArray, periods: int, period: float, *, offset: float = 0.0
    ) -> None:
        super().__init__()
        if periods < 1 or not period > 0.0:
            raise ValueError(
                f"StatePredictor needs a delay of one period or more, and a positive period, not {periods} "
                f"and {period}"
            )
        self._chain, self._load, self._period = robot_chain(robot), np.array(load, dtype=float), period
        n = len(robot.joints)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (3 + n))
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self._governor = self.DeclareVectorInputPort("governor_command", 4)
        self._axes = self.DeclareVectorInputPort("axis_acceleration", 1 + n)
        self._kept = periods, 6 + n
        self.DeclareDiscreteState(np.zeros(periods * (6 + n)))
        # Without these tickets the commands, which depend on the prediction, would close an algebraic loop.
        used = {
            self.xd_ticket(),
            *(self.input_port_ticket(port.get_index()) for port in (self._robot, self._pose)),
        }
        self.DeclareVectorOutputPort("predicted_state", 2 * (3 + n), self._write_state, used)
        self.DeclareVectorOutputPort("predicted_pose", 3, self._write_pose, used)
        self.DeclarePeriodicDiscreteUpdateEvent(period_sec=period, offset_sec=offset, update=self._keep)

    def _predict(self, context: Context) -> tuple[FloatArray, FloatArray]:
        """Return the robot's state and the object's pose now."""
        robot, pose = self._robot.Eval(context), self._pose.Eval(context)
        kept = context.get_discrete_state_vector().value().reshape(self._kept)
        predicted, predicted_pose = np.empty_like(robot), np.empty(3)
        predict(self._chain, self._load[:2], robot, pose, kept, self._period, predicted, predicted_pose)
        return predicted, predicted_pose

    def _keep(self, context: Context, discrete_state: DiscreteValues) -> None:
        kept = context.get_discrete_state_vector().value().reshape(self._kept)
        now = np.empty(self._kept[1])
        wanted_accelerations(
            self._chain,
            self._load,
            *self._predict(context),
            self._governor.Eval(context)[2:],
            self._axes.Eval(context),
            now,
        )
        discrete_state.get_mutable_vector().SetFromVector(np.vstack([kept[1:], now]).ravel())

    def _write_state(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._predict(context)[0])

    def _write_pose(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._predict(context)[1])
