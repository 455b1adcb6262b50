"""Prescribed performance control of the object's angle and of one robot's joints as a block."""

from __future__ import annotations

from collections.abc import Sequence

from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.axis_table import track_axes, write_bounds
from coop_drake.systems.axis_laws import AxisLaw
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, index_of

__all__ = ["AxisPpc"]


class AxisPpc(Block):
    """Keeps the object's angle and every joint of one robot in their funnels: (17)-(20) and (35)-(39).

    ======= ======================== ========== ====================================================== =====
    input   ``object_state``         6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``current_cell``         2          index of the current cell, time of its entry [-, s]
    output  ``axis_acceleration``    1 + n      desired angular acceleration of the object [rad/s^2],  W
                                                of the joints [rad/s^2 or m/s^2]
    output  ``funnels``              2 (1 + n)  lower, then upper funnel bounds now [rad or m]
    ======= ======================== ========== ====================================================== =====

    No state: the funnels depend on the time since the cell was entered. The law is the same for all axes, so
    one block computes all axes of a robot; ``robot_state`` is not read where the robot has no joints.

    Args:
        laws: One law of the axes (theta, q_k) for each cell of the plan.

    Raises:
        ValueError: There is no law, or the laws differ in their number of axes or have none.
    """

    def __init__(self, laws: Sequence[AxisLaw]) -> None:
        super().__init__()
        if not laws or len({law.axes for law in laws}) != 1 or laws[0].axes < 1:
            raise ValueError("AxisPpc needs one law for each cell, all of the same axes, the angle first")
        self._tables = [law.table for law in laws]
        axes = laws[0].axes
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (2 + axes))
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self.DeclareVectorOutputPort("axis_acceleration", axes, self._write_acceleration)
        self.DeclareVectorOutputPort(
            "funnels",
            2 * axes,
            self._write_funnels,
            {self.time_ticket(), self.input_port_ticket(self._cell.get_index())},
        )

    def _write_acceleration(self, context: Context, output: BasicVector) -> None:
        cell, object_state = self._cell.Eval(context), self._object.Eval(context)
        table, time = self._tables[index_of(cell, len(self._tables))], context.get_time() - cell[1]
        robot = self._robot.Eval(context) if len(table) > 1 else object_state
        track_axes(table, time, object_state, robot, output.get_mutable_value())

    def _write_funnels(self, context: Context, output: BasicVector) -> None:
        cell = self._cell.Eval(context)
        table = self._tables[index_of(cell, len(self._tables))]
        write_bounds(table, context.get_time() - cell[1], output.get_mutable_value())
