"""One robot's report that it is ready for the next cell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.compiled import prepared
from coop_drake.laws.departure import quiet_margin
from coop_drake.systems.axis_laws import AxisLaw
from coop_drake.systems.block import NUMBER, VECTOR, Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, READY_SIZE, index_of
from coop_drake.systems.departure_monitor import ALARM_SIZE
from coop_drake.systems.nominal_kernels import NOMINAL_SIZE
from coop_drake.systems.ready_kernels import ready_conditions, robot_ready, robot_ready_along
from coop_drake.systems.reference_governor import GovernedCell
from coop_drake.tree.pose import FloatArray

MOVING = 1.0
"""Rate that counts where there are no samples yet, far beyond what counts as rest [m/s, rad/s]."""


class ReadyMonitor(Block):
    """Reports whether object and own joints may enter the next cell; in the last cell, whether they arrived.

    ======= ====================== ========== ====================================================== =====
    input   ``object_state``       6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``        2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``governor_position``  2          p_G as the robot keeps it [m]                          W
    input   ``current_cell``       2          index of the current cell, time of its entry [-, s]
    input   ``nominal``            6          what ``NominalGovernor`` shows; only with ``nominal``
    input   ``alarm``              3          what ``DepartureMonitor`` says; only with ``nominal``
    output  ``ready``              2          index of the current cell, signed margin [-]
    ======= ====================== ========== ====================================================== =====

    The report is all that a robot sends to others: whether it is ready, and for which cell. With ``nominal``
    a robot is ready where its nominal motion may enter the next cell and its monitor is quiet.

    No state, unless rates are averaged: then one discrete group, updated every ``period`` in the last cell,
    the rates of the last samples, which count as ``MOVING`` before there are so many.

    Args:
        cells: Governor's data of every cell.
        laws: Laws of the axes (theta, q_k) in every cell.
        inradii: R of every transition [m].
        goal_position: Where the object shall end, shape (2,) [m].
        position_tolerance: How close to it counts as arrived [m].
        nominal: Whether the position is judged by its nominal motion.
        averaged: Number of samples over which rates are averaged in the last cell, 0 for none.
        period: Time between samples [s]; needed where rates are averaged.
        offset: Time of the first sample [s].

    Raises:
        ValueError: The sequences are empty or differ in length, or the tolerance is not positive.
    """

    def __init__(
        self,
        cells: Sequence[GovernedCell],
        laws: Sequence[AxisLaw],
        inradii: Sequence[float],
        goal_position: FloatArray,
        position_tolerance: float,
        nominal: bool = False,
        *,
        averaged: int = 0,
        period: float | None = None,
        offset: float = 0.0,
    ) -> None:
        super().__init__()
        if not cells or not len(cells) == len(laws) == len(inradii):
            raise ValueError(
                "ReadyMonitor needs one governed cell, one law and one inradius for each cell, not "
                f"{len(cells)}, {len(laws)} and {len(inradii)}"
            )
        if not position_tolerance > 0.0:
            raise ValueError(f"ReadyMonitor's position tolerance must be positive, not {position_tolerance}")
        conditions = ready_conditions(
            [law.table for law in laws],
            [cell.clearance.edges for cell in cells],
            [cell.row for cell in cells],
            inradii,
            goal_position,
            position_tolerance,
        )
        law, more = (robot_ready_along, [VECTOR]) if nominal else (robot_ready, [])
        self._ready = [prepared(law, known, NUMBER, VECTOR, VECTOR, VECTOR, *more) for known in conditions]
        n = laws[0].axes - 1
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * (3 + n))
        self._governor = self.DeclareVectorInputPort("governor_position", 2)
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._nominal = self.DeclareVectorInputPort("nominal", NOMINAL_SIZE) if nominal else None
        self._alarm = self.DeclareVectorInputPort("alarm", ALARM_SIZE) if nominal else None
        self._averaged = averaged
        if averaged:
            self.DeclareDiscreteState(np.full(averaged * (3 + n), MOVING))
            self.declare_update(self._remember, period, offset)
        self.DeclareVectorOutputPort("ready", READY_SIZE, self._write_ready)

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        if index_of(self._current.Eval(context), len(self._ready)) + 1 < len(self._ready):
            return EventStatus.DidNothing()
        state, rates = context.get_discrete_state_vector().value(), self._object.Eval(context)[3:]
        joints = self._state.Eval(context)[len(self._state.Eval(context)) // 2 + 3 :]
        kept = state[len(rates) + len(joints) :]
        discrete_state.get_mutable_vector().SetFromVector(np.concatenate((kept, rates, joints)))
        return EventStatus.Succeeded()

    def _states(self, context: Context, index: int) -> tuple[FloatArray, FloatArray]:
        """Return the states of object and robot, in the last cell with averaged rates."""
        seen, robot = self._object.Eval(context), self._state.Eval(context)
        if self._averaged and index + 1 == len(self._ready):
            mean = context.get_discrete_state_vector().value().reshape(self._averaged, -1).mean(axis=0)
            seen, robot = seen.copy(), robot.copy()
            seen[3:], robot[len(robot) // 2 + 3 :] = mean[:3], mean[3:]
        return seen, robot

    def _write_ready(self, context: Context, output: BasicVector) -> None:
        current, report = self._current.Eval(context), output.get_mutable_value()
        index = index_of(current, len(self._ready))
        report[0] = index
        led = () if self._nominal is None else (self._nominal.Eval(context),)
        report[1] = self._ready[index](
            context.get_time() - current[1],
            *self._states(context, index),
            self._governor.Eval(context),
            *led,
        )
        if self._alarm is not None:
            report[1] = quiet_margin(report[1], self._alarm.Eval(context)[0])
