"""What a robot judges by its raw measurements: departures from its nominal motion, and arrival."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.laws import readiness
from coop_drake.laws.robot_dynamics import estimate_object, motion_room
from coop_drake.systems.block import ALARM_SIZE, CURRENT_CELL_SIZE, Block, index_of
from coop_drake.systems.kernels import NOMINAL_SIZE
from coop_drake.tree.arrays import FloatArray

LONG_AGO = -1e9
"""When something was above its level the last time, before anything was [s]."""


@dataclass(frozen=True)
class MonitoredRobot:
    """What a monitor needs to know.

    Attributes:
        chain: From the robot's base to its end effector.
        p_LE: The grasp in L, shape (2,) [m].
        mounting: See ``place_on_axes``, shape (1 + n,).
        levels: Of position, velocity, grasp, angle of the base, infinite where there is none, and of where
            the position goes, shape (5,).
        unseen: How far ahead that is [s].
        axis_alarms: Of the axes (theta, q_k) in every stage of every cell, of their rates, and of where both
            take them, shape (cells, stages, 3, 1 + n), or (cells, 1, 3, 0) where they have no nominal motion.
        alarm_times: Times since a cell's entry at which its stages begin, infinite for those that it does not
            have, shape (cells, stages) [s].
        start: (x, y, theta, q_k) at the beginning, shape (3 + n,).
        period: T [s].
        measurement_periods: Age of the measurements in periods [-].
        offset: Time of the first computation [s].
    """

    chain: FloatArray
    p_LE: FloatArray  # noqa: N815
    mounting: FloatArray
    levels: FloatArray
    unseen: float
    axis_alarms: FloatArray
    alarm_times: FloatArray
    start: FloatArray
    period: float
    measurement_periods: int
    offset: float = 0.0


class DepartureMonitor(Block):
    """Compares a robot's raw measurements with its nominal motion when they were made, ``laws/readiness.py``.

    ======= ================ ========== ============================================================== =====
    input   ``robot_state``  2 (3 + n)  z_k and its rate as measured, not predicted                    W
    input   ``object_pose``  3          pose of L as measured, not predicted                           W
    input   ``nominal``      6          what ``NominalGovernor`` shows; only p^ and p^' are read       W
    input   ``nominal_axes`` 2 (1 + n)  x^ and x^' of the axes (theta, q_k); only where axes have such a
                                        motion
    input   ``current_cell`` 2          index of the current cell, time of its entry; likewise [-, s]
    output  ``alarm``        3          0, 1 for a hold or 2 for brakes; the largest departure over its
                                        level, and the number of this level [-]
    ======= ================ ========== ============================================================== =====

    State: one discrete group, updated every period: when something was above its level the last time, then
    p^, p^', x^, x^', the current cell and the time since its entry in the last m samples, m being the age of
    measurements in periods, the latest first.
    """

    def __init__(self, robot: MonitoredRobot) -> None:
        super().__init__()
        self._robot, self._axes = robot, robot.axis_alarms.shape[3]
        size = 2 * (2 + robot.mounting.size)
        motion = motion_room(robot.chain)
        self._estimate = partial(estimate_object, robot.chain, robot.p_LE, motion)
        self._largest = partial(readiness.largest_departure, robot.p_LE, robot.mounting, motion[-1])
        self._state = self.DeclareVectorInputPort("robot_state", size)
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self._led = self.DeclareVectorInputPort("nominal", NOMINAL_SIZE)
        if self._axes:
            self._led_axes = self.DeclareVectorInputPort("nominal_axes", 2 * self._axes)
            self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        start = robot.start
        self.DeclareDiscreteState(self.state_at_rest(start[:2], start[2 : 2 + self._axes], 0))
        self._alarm = self.DeclareVectorOutputPort("alarm", ALARM_SIZE, self._write_alarm)
        self.declare_update(self._remember, robot.period, robot.offset)

    def state_at_rest(
        self, position: Sequence[float] | FloatArray, axes: FloatArray, cell: int
    ) -> FloatArray:
        """Return the state of a monitor whose robot rests in a cell, its nominal motion where it is.

        Args:
            position: p^ [m].
            axes: x^ of the axes that have a nominal motion [rad or m].
            cell: Index of the cell.
        """
        row = np.array([*position, 0.0, 0.0, *axes[: self._axes], *[0.0] * self._axes, cell, 0.0])
        return np.concatenate([[LONG_AGO], *[row] * self._robot.measurement_periods])

    def _now(self, context: Context) -> FloatArray:
        """Return p^, p^', x^, x^', the cell and the time since its entry, shape (6 + 2 axes,)."""
        led = self._led.Eval(context)[:4]
        if not self._axes:
            return np.array([*led, 0.0, 0.0])
        cell = self._cell.Eval(context)
        index = index_of(cell, len(self._robot.axis_alarms))
        return np.array([*led, *self._led_axes.Eval(context), index, context.get_time() - cell[1]])

    def _write_alarm(self, context: Context, output: BasicVector) -> None:
        past, robot = self.kept(context), self._robot
        then = past[-(6 + 2 * self._axes) :] if robot.measurement_periods else self._now(context)
        measured, seen = self._state.Eval(context), np.empty(6)
        self._estimate(measured, self._pose.Eval(context), seen)
        axes, cell = then[4:-2].reshape(2, -1).copy(), int(then[-2])
        stages = robot.alarm_times[cell], robot.axis_alarms[cell], float(then[-1])
        share, which = self._largest(
            measured, seen, then[:4].copy(), axes, robot.levels, *stages, robot.unseen
        )
        output.SetFromVector(
            [readiness.alarm_at(share, context.get_time(), float(past[0])), share, float(which)]
        )

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        past = self.kept(context)
        following = discrete_state.get_mutable_vector().get_mutable_value()
        following[0] = context.get_time() if self._alarm.Eval(context)[1] > 1.0 else past[0]
        if self._robot.measurement_periods:
            now = self._now(context)
            following[1 : 1 + now.size], following[1 + now.size :] = now, past[1 : -now.size]
        return EventStatus.Succeeded()


class ArrivalMonitor(Block):
    """Averages what a robot measures in the last cell and compares it with the goal, see ``arrival_margin``.

    ======= ================ ========== ======================================================== =====
    input   ``robot_state``  2 (3 + n)  z_k and its rate as measured, not predicted              W
    input   ``object_pose``  3          pose of L as measured, not predicted                     W
    input   ``current_cell`` 2          index of the current cell, time of its entry [-, s]
    output  ``arrival``      1          margin with which the goal is reached; negative before
                                        the last cell [-]
    ======= ================ ========== ======================================================== =====

    State: one discrete group, updated every ``period`` in the last cell: the pose and the joints of the last
    2 W samples there, the oldest ones first; infinite before there are so many.

    Args:
        goal: What they are compared with.
        cells: Number of cells of the plan.
        period: Time between samples [s].
        offset: Time of the first sample [s].
    """

    def __init__(self, goal: readiness.ArrivalGoal, cells: int, period: float, offset: float = 0.0) -> None:
        super().__init__()
        self._shape, self._cells = (2 * readiness.mean_samples(period), goal.place.size), cells
        self._margin = partial(readiness.arrival_margin, *goal)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * goal.place.size)
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        group = self.DeclareDiscreteState(np.full(self._shape[0] * self._shape[1], np.inf))
        read = {self.discrete_state_ticket(group), self.input_port_ticket(self._cell.get_index())}
        self.DeclareVectorOutputPort("arrival", 1, self._write_arrival, read)
        self.declare_update(self._remember, period, offset)

    def _is_last(self, context: Context) -> bool:
        return index_of(self._cell.Eval(context), self._cells) + 1 == self._cells

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        if not self._is_last(context):
            return EventStatus.DidNothing()
        state, pose = self.kept(context), self._pose.Eval(context)
        joints = self._state.Eval(context)[3 : self._shape[1]]
        discrete_state.get_mutable_vector().SetFromVector(
            np.concatenate([state[self._shape[1] :], pose, joints])
        )
        return EventStatus.Succeeded()

    def _write_arrival(self, context: Context, output: BasicVector) -> None:
        if not self._is_last(context):
            output.SetFromVector([readiness.FAR])
            return
        recent = self.kept(context).reshape(self._shape)
        output.SetFromVector([self._margin(recent, self._shape[0] - 1)])
