"""One robot of a team that passes from cell to cell: it follows a motion that all robots know."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.answers.motion import Motion
from coop_drake.laws.motion import motion_at, pulled
from coop_drake.systems import kernels
from coop_drake.systems.block import CURRENT_CELL_SIZE, Block, index_of
from coop_drake.systems.governor import GovernedCell
from coop_drake.systems.ppc import AxisLaw
from coop_drake.systems.readiness import ReadyMonitor
from coop_drake.tree.arrays import FloatArray


class _Follower(Block):
    """What follows a motion whose phase is the time."""

    def __init__(self, motion: Motion) -> None:
        super().__init__()
        self._motion = motion

    def _nominal(self, context: Context) -> FloatArray:
        """Return the nominal configuration, its rate and its acceleration now, shape (3, 3 + n)."""
        nominal = np.empty((3, self._motion.points.shape[1]))
        motion_at(self._motion.points, self._motion.period, context.get_time(), 1.0, 0.0, nominal)
        return nominal


class MotionGovernor(_Follower):
    """Leads the object's position along the nominal motion, see ``laws/motion.py``.

    ======= ======================== ==== ========================================================== =====
    input   ``object_state``         6    pose and twist of L                                        W
    input   ``current_cell``         2    index of the current cell, time of its entry [-, s]
    output  ``governor_command``     4    nominal velocity of L's origin [m/s], its desired          W
                                          acceleration [m/s^2]
    output  ``governor_position``    2    nominal position of L's origin [m]                         W
    output  ``energy_margin``        1    Delta E of (15) of the departure from it [m^2/s^2]
    ======= ======================== ==== ========================================================== =====

    No state.

    Args:
        motion: The motion.
        cells: One entry for each cell of the plan.
    """

    def __init__(self, motion: Motion, cells: Sequence[GovernedCell]) -> None:
        super().__init__(motion)
        self._edges = [cell.clearance.edges for cell in cells]
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self.DeclareVectorOutputPort("governor_command", 4, self._write_command)
        self.DeclareVectorOutputPort("governor_position", 2, self._write_position, {self.time_ticket()})
        self.DeclareVectorOutputPort("energy_margin", 1, self._write_margin)

    def _write_command(self, context: Context, output: BasicVector) -> None:
        nominal, state, command = (
            self._nominal(context),
            self._object.Eval(context),
            output.get_mutable_value(),
        )
        gains = self._motion.gains[0]
        command[:2] = nominal[1, :2]
        for axis in range(2):
            command[2 + axis] = pulled(nominal, axis, state[axis], state[3 + axis], *gains)

    def _write_position(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._nominal(context)[0, :2])

    def _write_margin(self, context: Context, output: BasicVector) -> None:
        nominal, departing = self._nominal(context), self._object.Eval(context).copy()
        departing[3:5] -= nominal[1, :2]
        edges = self._edges[index_of(self._current.Eval(context), len(self._edges))]
        output[0] = kernels.cell_margin(edges, self._motion.gains[0][0], departing, nominal[0, :2])[0]


class MotionAxes(_Follower):
    """Leads the object's angle and every joint of one robot along the nominal motion.

    ======= ======================== ========== ==================================================== =====
    input   ``object_state``         6          pose and twist of L, angle unwrapped                 W
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)       W
    input   ``current_cell``         2          index of the current cell, time of its entry [-, s]
    output  ``axis_acceleration``    1 + n      desired angular acceleration of the object           W
                                                [rad/s^2], of the joints [rad/s^2 or m/s^2]
    output  ``funnels``              2 (1 + n)  lower, then upper ends of the cell [rad or m]
    ======= ======================== ========== ==================================================== =====

    No state; ``robot_state`` is not read where the robot has no joints.

    Args:
        motion: The motion.
        laws: The axes (theta, q_k) in each cell; their cells alone are read.
        axes: Where these axes stand in (x, y, theta, q).
    """

    def __init__(self, motion: Motion, laws: Sequence[AxisLaw], axes: Sequence[int]) -> None:
        super().__init__(motion)
        self._axes = axes
        self._bounds = [np.concatenate([law.funnel.slice_lower, law.funnel.slice_upper]) for law in laws]
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (2 + len(axes)))
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self.DeclareVectorOutputPort("axis_acceleration", len(axes), self._write_acceleration)
        cell = {self.input_port_ticket(self._current.get_index())}
        self.DeclareVectorOutputPort("funnels", 2 * len(axes), self._write_bounds, cell)

    def _write_acceleration(self, context: Context, output: BasicVector) -> None:
        nominal, state, wanted = (
            self._nominal(context),
            self._object.Eval(context),
            output.get_mutable_value(),
        )
        gains = self._motion.gains[1]
        wanted[0] = pulled(nominal, self._axes[0], state[2], state[5], *gains)
        if len(self._axes) > 1:
            robot, half = self._robot.Eval(context), 2 + len(self._axes)
            for i, axis in enumerate(self._axes[1:], start=3):
                wanted[i - 2] = pulled(nominal, axis, robot[i], robot[half + i], *gains)

    def _write_bounds(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._bounds[index_of(self._current.Eval(context), len(self._bounds))])


class PassingMonitor(ReadyMonitor):
    """Reports that it is time to enter the next cell along the motion; in the last one, that all is done.

    ======= ======================== ========== ==================================================== =====
    input   ``object_state``         6          pose and twist of L                                  W
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)       W
    input   ``governor_position``    2          nominal position of L's origin [m]                   W
    input   ``current_cell``         2          index of the current cell, time of its entry [-, s]
    output  ``ready``                2          index of the cell that the report is about, margin
    ======= ======================== ========== ==================================================== =====

    No state. The margin is the time since the motion entered the next cell [s]; in the last one it is that of
    ``ReadyMonitor`` once the motion has ended.

    Args:
        motion: The motion.
        others: Those of ``ReadyMonitor``.
    """

    def __init__(self, motion: Motion, *others: object, **named: object) -> None:
        super().__init__(*others, **named)  # type: ignore[arg-type]
        self._entered, self._end = motion.windows[1:, 0].tolist(), motion.duration

    def _write_ready(self, context: Context, output: BasicVector) -> None:
        index = index_of(self._current.Eval(context), len(self._entered) + 1)
        if index < len(self._entered):
            output.SetFromVector([index, context.get_time() - self._entered[index]])
        else:
            super()._write_ready(context, output)
            left = context.get_time() - self._end
            output[1] = min(output[1], left) if left < 0.0 else output[1]
