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
from coop_drake.systems.motion import STAMPED
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
        axis_alarms: Of the axes (theta, q_k), of their rates, and of where both take them, shape (3, 1 + n).
        period: T [s].
        offset: Time of the first computation [s].
    """

    chain: FloatArray
    p_LE: FloatArray  # noqa: N815
    mounting: FloatArray
    levels: FloatArray
    unseen: float
    axis_alarms: FloatArray
    period: float
    offset: float = 0.0


class DepartureMonitor(Block):
    """Compares a robot's raw measurements with the motion at their time stamp, see ``laws/readiness.py``.

    ======= ================== ========== ============================================================ =====
    input   ``robot_state``    2 (3 + n)  z_k and its rate as measured, not predicted                  W
    input   ``object_pose``    3          pose of L as measured, not predicted                         W
    input   ``nominal_motion`` 9 (3 + n)  what ``MotionFollower`` shows                                W
    output  ``alarm``          3          0, 1 for a hold or 2 for brakes; the largest departure over
                                          its level, and the number of this level [-]
    ======= ================== ========== ============================================================ =====

    State: one discrete group, updated every period: when something was above its level the last time.

    Args:
        robot: What it needs to know; its levels hold in all cells and at all times.
        joints: Where the robot's joints stand in (x, y, theta, q).
        coordinates: Number of coordinates of the motion, 3 + n.
    """

    def __init__(self, robot: MonitoredRobot, joints: Sequence[int], coordinates: int) -> None:
        super().__init__()
        self._robot, self._axes, self._shape = robot, [2, *joints], (3, 3, coordinates)
        motion = motion_room(robot.chain)
        self._estimate = partial(estimate_object, robot.chain, robot.p_LE, motion)
        self._largest = partial(readiness.largest_departure, robot.p_LE, robot.mounting, motion[-1])
        self._state = self.DeclareVectorInputPort("robot_state", 2 * (2 + robot.mounting.size))
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self._nominal = self.DeclareVectorInputPort("nominal_motion", 9 * coordinates)
        self.DeclareDiscreteState(np.array([LONG_AGO]))
        self._alarm = self.DeclareVectorOutputPort("alarm", ALARM_SIZE, self._write_alarm)
        self.declare_update(self._remember, robot.period, robot.offset)

    def _write_alarm(self, context: Context, output: BasicVector) -> None:
        robot, measured, seen = self._robot, self._state.Eval(context), np.empty(6)
        nominal = self._nominal.Eval(context).reshape(self._shape)[STAMPED]
        self._estimate(measured, self._pose.Eval(context), seen)
        led, axes = nominal[:2, :2].ravel(), np.ascontiguousarray(nominal[:2, self._axes])
        levels = robot.levels, robot.axis_alarms, robot.unseen
        share, which = self._largest(measured, seen, led, axes, *levels)
        last = float(self.kept(context)[0])
        output.SetFromVector([readiness.alarm_at(share, context.get_time(), last), share, float(which)])

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        if not self._alarm.Eval(context)[1] > 1.0:
            return EventStatus.DidNothing()
        discrete_state.get_mutable_vector().SetAtIndex(0, context.get_time())
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
