"""One robot's report that it is ready for the next cell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.departure import quiet_margin
from coop_drake.systems.axis_laws import AxisLaw
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, READY_SIZE, index_of
from coop_drake.systems.departure_monitor import ALARM_SIZE
from coop_drake.systems.nominal_kernels import NOMINAL_SIZE, NOTHING
from coop_drake.systems.ready_kernels import ready_conditions, robot_arrived, robot_ready, robot_ready_along
from coop_drake.systems.reference_governor import GovernedCell
from coop_drake.tree.pose import FloatArray


class ReadyMonitor(Block):
    """Reports whether object and own joints may enter the next cell; in the last cell, whether they arrived.

    ======= ====================== ========== ====================================================== =====
    input   ``object_state``       6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``        2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``governor_position``  2          p_G as the robot keeps it [m]                          W
    input   ``current_cell``       2          index of the current cell, time of its entry [-, s]
    input   ``nominal``            6          what ``NominalGovernor`` shows; only with ``nominal``
    input   ``alarm``              3          what ``DepartureMonitor`` says; only with ``nominal``
    input   ``arrival``            1          what ``ArrivalMonitor`` shows; only with ``measured``
    output  ``ready``              2          index of the current cell, signed margin [-]
    ======= ====================== ========== ====================================================== =====

    The report is all that a robot sends to others: whether it is ready, and for which cell. With ``nominal``
    a robot is ready where its nominal motion may enter the next cell and its monitor is quiet.

    No state.

    Args:
        cells: Governor's data of every cell.
        laws: Laws of the axes (theta, q_k) in every cell.
        inradii: R of every transition [m].
        goal_position: Where the object shall end, shape (2,) [m].
        position_tolerance: How close to it counts as arrived [m].
        nominal: Whether the position is judged by its nominal motion.
        measured: Whether the robot is sampled: it judges its arrival by the means of what it measures.
        axes_led: Whether angles and joints in the inputs are those of their nominal motions.

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
        measured: bool = False,
        axes_led: bool = False,
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
        law = robot_ready_along if nominal else robot_ready
        self._ready = [partial(law, *known) for known in conditions]
        n = laws[0].axes - 1
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * (3 + n))
        self._governor = self.DeclareVectorInputPort("governor_position", 2)
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._nominal = self.DeclareVectorInputPort("nominal", NOMINAL_SIZE) if nominal else None
        self._alarm = self.DeclareVectorInputPort("alarm", ALARM_SIZE) if nominal else None
        self._arrival = self.DeclareVectorInputPort("arrival", 1) if measured else None
        last = conditions[-1]
        known = last.table, last.goal, last.tolerance, axes_led
        self._arrived: Callable[..., float] = partial(robot_arrived, *known)
        self.DeclareVectorOutputPort("ready", READY_SIZE, self._write_ready)

    def _write_ready(self, context: Context, output: BasicVector) -> None:
        current, report = self._current.Eval(context), output.get_mutable_value()
        index = index_of(current, len(self._ready))
        report[0] = index
        seen, robot = self._object.Eval(context), self._state.Eval(context)
        led = () if self._nominal is None else (self._nominal.Eval(context),)
        if self._arrival is not None and index + 1 == len(self._ready):
            report[1] = self._arrived(
                seen, robot, *(led or (NOTHING,)), float(self._arrival.Eval(context)[0])
            )
        else:
            time, governor = context.get_time() - current[1], self._governor.Eval(context)
            report[1] = self._ready[index](time, seen, robot, governor, *led)
        if self._alarm is not None:
            report[1] = quiet_margin(report[1], self._alarm.Eval(context)[0])
