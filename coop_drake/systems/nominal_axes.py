"""The nominal motion of one robot's axes as a block: the law acts on a model that all robots share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.answers.axis_tracking import AxisTracking
from coop_drake.laws.nominal_axes import carry_axes, pulled_axis
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class AxisMotion:
    """What the nominal motion of some axes needs to know.

    Attributes:
        tracking: Gains of the pull.
        start: Where the axes (theta, q_k) are at rest at the beginning, shape (1 + n,) [rad or m].
        period: T, the control period [s].
        lag: Time constant of the actuators that the plan's budget states [s].
        measurement_periods: Age of the measurements in periods [-].
        offset: Time of the first computation [s].
    """

    tracking: AxisTracking
    start: FloatArray
    period: float
    lag: float
    measurement_periods: int
    offset: float = 0.0


class NominalAxes(Block):
    """Leads the object's angle and one robot's joints along a nominal motion, see ``laws/nominal_axes.py``.

    ======= ======================== ========== ====================================================== =====
    input   ``object_state``         6          pose and twist of L as measured                        W
    input   ``robot_state``          2 (3 + n)  z_k and its rate as measured                           W
    input   ``axis_acceleration``    1 + n      what the law asks for, of the nominal motion           W
    output  ``nominal_object``       6          ``object_state`` with the nominal angle and its rate   W
    output  ``nominal_robot``        2 (3 + n)  ``robot_state`` with the nominal joints and rates      W
    output  ``pulled_axes``          1 + n      desired accelerations of the object's angle [rad/s^2], W
                                                of the joints [rad/s^2 or m/s^2], with the pull
    ======= ======================== ========== ====================================================== =====

    State: one discrete group (x^, x^', a^ of all axes, then x^ and x^' of the last m samples, m being the age
    of measurements in periods, the latest first), updated every period. ``robot_state`` is not read where the
    robot has no joints.
    """

    def __init__(self, motion: AxisMotion) -> None:
        super().__init__()
        axes = motion.start.size
        self._motion, self._gains = motion, (motion.tracking.stiffness, motion.tracking.damping)
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (2 + axes))
        self._law = self.DeclareVectorInputPort("axis_acceleration", axes)
        rest = np.zeros_like(motion.start)
        past = [motion.start, rest] * motion.measurement_periods
        group = self.DeclareDiscreteState(np.concatenate([motion.start, rest, rest, *past]))
        ports = self._object, self._robot, self._law
        measured_object, measured_robot, asked = (self.input_port_ticket(port.get_index()) for port in ports)
        nominal = self.discrete_state_ticket(group)
        # Without these the law's answer would seem to depend on itself.
        self.DeclareVectorOutputPort("nominal_object", 6, self._write_object, {measured_object, nominal})
        self.DeclareVectorOutputPort(
            "nominal_robot", 2 * (2 + axes), self._write_robot, {measured_robot, nominal}
        )
        self.DeclareVectorOutputPort(
            "pulled_axes", axes, self._write_pulled, {measured_object, measured_robot, asked, nominal}
        )
        self.declare_update(self._step, motion.period, motion.offset)

    def _states(self, context: Context) -> FloatArray:
        """Return x^, x^' and a^, then older x^ and x^', shape (3 + 2 m, 1 + n)."""
        state: FloatArray = context.get_discrete_state_vector().value()
        return state.reshape(-1, self._motion.start.size)

    def _write_object(self, context: Context, output: BasicVector) -> None:
        shown, states = output.get_mutable_value(), self._states(context)
        shown[:] = self._object.Eval(context)
        shown[2], shown[5] = states[0, 0], states[1, 0]

    def _write_robot(self, context: Context, output: BasicVector) -> None:
        shown, states, n = output.get_mutable_value(), self._states(context), self._motion.start.size - 1
        shown[:] = self._robot.Eval(context)
        shown[3 : 3 + n], shown[6 + n :] = states[0, 1:], states[1, 1:]

    def _write_pulled(self, context: Context, output: BasicVector) -> None:
        states, pulled, n = self._states(context), output.get_mutable_value(), self._motion.start.size - 1
        expected = states[-2:] if self._motion.measurement_periods else states[:2]
        law, measured = self._law.Eval(context), self._object.Eval(context)
        robot = self._robot.Eval(context) if n else measured
        for i in range(1 + n):
            x, v = (measured[2], measured[5]) if i == 0 else (robot[2 + i], robot[5 + n + i])
            pulled[i] = pulled_axis(law[i], x, v, (expected[0, i], expected[1, i]), self._gains)

    def _step(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        motion, states = self._motion, self._states(context)
        following = discrete_state.get_mutable_vector().get_mutable_value().reshape(states.shape)
        carry_axes(states[:3], self._law.Eval(context), motion.period, motion.lag, following[:3])
        if motion.measurement_periods:
            following[3:5], following[5:] = states[:2], states[3:-2]
        return EventStatus.Succeeded()
