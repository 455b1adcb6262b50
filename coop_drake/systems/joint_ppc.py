"""Prescribed performance control of one robot's joints as a block."""

from __future__ import annotations

from collections.abc import Sequence

from pydrake.systems.framework import BasicVector, Context

from coop_drake.control.kernels import track_state, write_walls
from coop_drake.geometry.pose import FloatArray
from coop_drake.systems.axis_laws import AxisLaw
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, index_of

__all__ = ["JointPpc"]


class JointPpc(Block):
    """Keeps every joint of one robot in its funnel: the accelerations of (35)-(39).

    ======= ======================== ========== ===================================================== =====
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)            W
    input   ``current_cell``         2          index of the current cell, time of its entry [-, s]
    output  ``joint_acceleration``   n          desired accelerations [rad/s^2 or m/s^2]
    output  ``joint_funnels``        2 n        lower walls, then upper walls of the funnels now [rad or m]
    ======= ======================== ========== ===================================================== =====

    No state: the funnels depend on the time since the cell was entered.

    Args:
        laws: One law of the robot's n joints for each cell of the plan.

    Raises:
        ValueError: There is no law, or the laws differ in their number of joints.
    """

    def __init__(self, laws: Sequence[AxisLaw]) -> None:
        super().__init__()
        if not laws or len({law.axes for law in laws}) != 1:
            raise ValueError("JointPpc needs one law of the same joints for each cell")
        self._tables = [law.table for law in laws]
        self._joints = n = laws[0].axes
        self._state = self.DeclareVectorInputPort("robot_state", 2 * (3 + n))
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self.DeclareVectorOutputPort("joint_acceleration", n, self._write_acceleration)
        self.DeclareVectorOutputPort(
            "joint_funnels",
            2 * n,
            self._write_funnels,
            {self.time_ticket(), self.input_port_ticket(self._cell.get_index())},
        )

    def _table(self, context: Context) -> tuple[FloatArray, float]:
        cell = self._cell.Eval(context)
        return self._tables[index_of(cell, len(self._tables))], context.get_time() - cell[1]

    def _write_acceleration(self, context: Context, output: BasicVector) -> None:
        table, time = self._table(context)
        track_state(table, time, self._state.Eval(context), 3, 6 + self._joints, output.get_mutable_value())

    def _write_funnels(self, context: Context, output: BasicVector) -> None:
        write_walls(*self._table(context), output.get_mutable_value())
