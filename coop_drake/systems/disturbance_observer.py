"""A robot's estimate of what accelerates the object and its joints beside the commands, and what it does."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.disturbance import observe
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


class DisturbanceObserver(Block):
    """Estimates slow disturbances from a robot's own motion, and takes them off its commands.

    Friction, a slope or a push change the acceleration of the object and of the joints. Every robot sees it
    in the object's twist, which it knows from its own motion, and in the rates of its joints. All robots
    together give what the object lacks, each by its share, because each takes off the same acceleration.

    ======= ========================= ========== ====================================================== =====
    input   ``object_state``          6          pose and twist of L                                    W
    input   ``robot_state``           2 (3 + n)  z_k and its rate, of which rates of joints are used    W
    input   ``governor_command``      4          rate of p_G; acceleration wanted for L's origin        W
    input   ``axis_acceleration``     1 + n      accelerations wanted for the object's angle and joints W
    input   ``observed_rates``        3 + n      the observer's state, kept by an integrator outside
    output  ``observer_rate``         3 + n      its rate
    output  ``compensated_command``   4          governor_command less the disturbance                  W
    output  ``compensated_axes``      1 + n      axis_acceleration less the disturbance                 W
    output  ``disturbance``           3 + n      estimated acceleration beside the commands, of (x, y,  W
                                                 theta) of L and of the joints
    ======= ========================= ========== ====================================================== =====

    No state: an integrator outside keeps it.

    Args:
        joints: Number n of the robot's joints.
        gain: Gain of ``observe`` [1/s].
        leak: Leak of ``observe`` [1/s].

    Raises:
        ValueError: The gain is not positive, or the leak is negative.
    """

    def __init__(self, joints: int, gain: float, leak: float) -> None:
        super().__init__()
        if not (gain > 0.0 and leak >= 0.0):
            raise ValueError(
                f"DisturbanceObserver needs a positive gain and no negative leak, not {gain} and {leak}"
            )
        self._size, self._gains = 3 + joints, (gain, leak)
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * self._size)
        self._governor = self.DeclareVectorInputPort("governor_command", 4)
        self._axes = self.DeclareVectorInputPort("axis_acceleration", 1 + joints)
        self._state = self.DeclareVectorInputPort("observed_rates", self._size)
        self.DeclareVectorOutputPort("observer_rate", self._size, self._write_rate)
        self.DeclareVectorOutputPort("compensated_command", 4, self._write_command)
        self.DeclareVectorOutputPort("compensated_axes", 1 + joints, self._write_axes)
        self.DeclareVectorOutputPort("disturbance", self._size, self._write_disturbance)

    def _observe(self, context: Context) -> tuple[FloatArray, FloatArray]:
        """Return the rate of the state, and the disturbance."""
        state_rate, disturbance = np.empty(self._size), np.empty(self._size)
        rates = np.concatenate([self._object.Eval(context)[3:], self._robot.Eval(context)[3 + self._size :]])
        wanted = np.concatenate([self._governor.Eval(context)[2:], self._axes.Eval(context)])
        observe(rates, wanted, self._state.Eval(context), *self._gains, state_rate, disturbance)
        return state_rate, disturbance

    def _write_rate(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._observe(context)[0])

    def _write_command(self, context: Context, output: BasicVector) -> None:
        command = output.get_mutable_value()
        command[:] = self._governor.Eval(context)
        command[2:] -= self._observe(context)[1][:2]

    def _write_axes(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._axes.Eval(context) - self._observe(context)[1][2:])

    def _write_disturbance(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._observe(context)[1])
