"""The nominal motion of one robot's axes as a block: the law acts on a model that all robots share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.answers.budget import AxisTracking
from coop_drake.laws.nominal_axes import carry_axes, place_on_axes, pull_axes
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
        mounting: Yaw of the base in the object where all joints are at zero [rad], then what a unit of every
            joint turns the base by in the object [-], shape (1 + n,).
        offset: Time of the first computation [s].
    """

    tracking: AxisTracking
    start: FloatArray
    period: float
    lag: float
    measurement_periods: int
    mounting: FloatArray
    offset: float = 0.0


class NominalAxes(Block):
    """Leads the object's angle and one robot's joints along a nominal motion, see ``laws/nominal_axes.py``.

    ======= ======================== ========== ====================================================== =====
    input   ``object_state``         6          pose and twist of L as measured                        W
    input   ``robot_state``          2 (3 + n)  z_k and its rate as measured                           W
    input   ``axis_acceleration``    1 + n      what the law asks for, of the nominal motion           W
    output  ``nominal_object``       6          ``object_state`` with the nominal angle and its rate   W
    output  ``nominal_robot``        2 (3 + n)  ``robot_state`` with the nominal yaw of the base,      W
                                                joints and rates of both
    output  ``object_ahead``         6          as ``nominal_object``, half a period and a lag later   W
    output  ``robot_ahead``          2 (3 + n)  as ``nominal_robot``, half a period and a lag later    W
    output  ``nominal_axes``         2 (1 + n)  x^ and x^' of the axes (theta, q_k)
    output  ``pulled_axes``          1 + n      desired accelerations of the object's angle [rad/s^2], W
                                                of the joints [rad/s^2 or m/s^2], with the pull
    ======= ======================== ========== ====================================================== =====

    State: one discrete group (x^, x^', a^ of all axes, then x^ and x^' of the last m samples, m being the age
    of measurements in periods, the latest first), updated every period. ``robot_state`` is not read for
    ``pulled_axes`` where the robot has no joints.

    An effort acts half a period and a lag after it was computed, on average. The blocks that turn
    accelerations into efforts therefore take the angles and rates of then.
    """

    def __init__(self, motion: AxisMotion) -> None:
        super().__init__()
        axes = motion.start.size
        self._motion, self._gains = motion, (motion.tracking.stiffness, motion.tracking.damping)
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (2 + axes))
        self._law = self.DeclareVectorInputPort("axis_acceleration", axes)
        group = self.DeclareDiscreteState(self.state_at_rest(motion.start))
        ports = self._object, self._robot, self._law
        of_object, of_robot, asked = (self.input_port_ticket(port.get_index()) for port in ports)
        nominal = self.discrete_state_ticket(group)
        # Without these the law's answer would seem to depend on itself.
        for name, size, calc, read in (
            ("nominal_object", 6, self._write_object, {of_object}),
            ("nominal_robot", 2 * (2 + axes), self._write_robot, {of_robot}),
            ("object_ahead", 6, self._write_object_ahead, {of_object, asked}),
            ("robot_ahead", 2 * (2 + axes), self._write_robot_ahead, {of_robot, asked}),
            ("nominal_axes", 2 * axes, self._write_axes, set()),
            ("pulled_axes", axes, self._write_pulled, {of_object, of_robot, asked}),
        ):
            self.DeclareVectorOutputPort(name, size, calc, read | {nominal})
        self.declare_update(self._step, motion.period, motion.offset)

    def state_at_rest(self, axes: FloatArray) -> FloatArray:
        """Return the state of a motion that begins at rest at these axes (theta, q_k) [rad or m]."""
        rest = np.zeros_like(axes)
        return np.concatenate([axes, rest, rest, *[axes, rest] * self._motion.measurement_periods])

    def states_of(self, context: Context) -> FloatArray:
        """Return x^, x^' and a^, then older x^ and x^', shape (3 + 2 m, 1 + n)."""
        state: FloatArray = context.get_discrete_state_vector().value()
        return state.reshape(-1, self._motion.start.size)

    def _ahead(self, context: Context) -> FloatArray:
        """Return x^, x^' and a^ half a period and a lag later, shape (3, 1 + n)."""
        later, motion = np.empty((3, self._motion.start.size)), self._motion
        time = 0.5 * motion.period + motion.lag
        carry_axes(self.states_of(context)[:3], self._law.Eval(context), time, motion.lag, later)
        return later

    def _write_object(self, context: Context, output: BasicVector) -> None:
        self._show_object(context, self.states_of(context), output)

    def _write_object_ahead(self, context: Context, output: BasicVector) -> None:
        self._show_object(context, self._ahead(context), output)

    def _show_object(self, context: Context, states: FloatArray, output: BasicVector) -> None:
        shown = output.get_mutable_value()
        shown[:] = self._object.Eval(context)
        shown[2], shown[5] = states[0, 0], states[1, 0]

    def _write_robot(self, context: Context, output: BasicVector) -> None:
        self._show_robot(context, self.states_of(context), output)

    def _write_robot_ahead(self, context: Context, output: BasicVector) -> None:
        self._show_robot(context, self._ahead(context), output)

    def _show_robot(self, context: Context, states: FloatArray, output: BasicVector) -> None:
        shown = output.get_mutable_value()
        shown[:] = self._robot.Eval(context)
        place_on_axes(states, self._motion.mounting, shown)

    def _write_axes(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.states_of(context)[:2].ravel())

    def _write_pulled(self, context: Context, output: BasicVector) -> None:
        states, law, seen = self.states_of(context), self._law.Eval(context), self._object.Eval(context)
        expected = states[-2:] if self._motion.measurement_periods else states[:2]
        robot = self._robot.Eval(context) if states.shape[1] > 1 else seen
        pull_axes(law, seen, robot, expected, self._gains, output.get_mutable_value())

    def _step(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        motion, states = self._motion, self.states_of(context)
        following = discrete_state.get_mutable_vector().get_mutable_value().reshape(states.shape)
        carry_axes(states[:3], self._law.Eval(context), motion.period, motion.lag, following[:3])
        if motion.measurement_periods:
            following[3:5], following[5:] = states[:2], states[3:-2]
        return EventStatus.Succeeded()
