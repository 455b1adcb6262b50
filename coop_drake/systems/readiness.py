"""When the team goes on to the next cell: every robot's report, and the supervisor that hears them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.systems import kernels
from coop_drake.systems.block import CURRENT_CELL_SIZE, READY_SIZE, Block, index_of
from coop_drake.systems.governor import GovernedCell
from coop_drake.systems.ppc import AxisLaw
from coop_drake.tree.arrays import FloatArray


class ReadyMonitor(Block):
    """Reports whether object and own joints may enter the next cell; in the last cell, whether they arrived.

    ======= ====================== ========== ====================================================== =====
    input   ``object_state``       6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``        2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``governor_position``  2          p_G as the robot keeps it [m]                          W
    input   ``current_cell``       2          index of the current cell, time of its entry [-, s]
    input   ``arrival``            1          what ``ArrivalMonitor`` shows; only with ``measured``
    output  ``ready``              2          index of the current cell, signed margin [-]
    ======= ====================== ========== ====================================================== =====

    The report is all that a robot sends to others: whether it is ready, and for which cell.

    No state.

    Args:
        cells: Governor's data of every cell.
        laws: Laws of the axes (theta, q_k) in every cell.
        inradii: R of every transition [m].
        goal_position: Where the object shall end, shape (2,) [m].
        position_tolerance: How close to it counts as arrived [m].
        measured: Whether the robot is sampled: it judges its arrival by the means of what it measures.

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
        *,
        measured: bool = False,
    ) -> None:
        super().__init__()
        if not cells or not len(cells) == len(laws) == len(inradii):
            raise ValueError(
                "ReadyMonitor needs one governed cell, one law and one inradius for each cell, not "
                f"{len(cells)}, {len(laws)} and {len(inradii)}"
            )
        if not position_tolerance > 0.0:
            raise ValueError(f"ReadyMonitor's position tolerance must be positive, not {position_tolerance}")
        conditions = kernels.ready_conditions(
            [law.table for law in laws],
            [cell.clearance.edges for cell in cells],
            [cell.row for cell in cells],
            inradii,
            goal_position,
            position_tolerance,
        )
        self._ready = [partial(kernels.robot_ready, known) for known in conditions]
        n = laws[0].axes - 1
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * (3 + n))
        self._governor = self.DeclareVectorInputPort("governor_position", 2)
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._arrival = self.DeclareVectorInputPort("arrival", 1) if measured else None
        self.DeclareVectorOutputPort("ready", READY_SIZE, self._write_ready)

    def _write_ready(self, context: Context, output: BasicVector) -> None:
        current, report = self._current.Eval(context), output.get_mutable_value()
        index = index_of(current, len(self._ready))
        report[0] = index
        seen, robot = self._object.Eval(context), self._state.Eval(context)
        if self._arrival is not None and index + 1 == len(self._ready):
            report[1] = self._arrival.Eval(context)[0]
        else:
            time, governor = context.get_time() - current[1], self._governor.Eval(context)
            report[1] = self._ready[index](time, seen, robot, governor)


class CellPlanner(Block):
    """Advances to the next cell of the plan when all robots are ready to leave the current one.

    A robot is ready when its report carries the current cell's index and a margin that is not negative.
    A report about another cell is stale and never counts, so that no report switches twice; a channel that
    holds samples starts at index -1 for the same reason. All robots read one output and switch together.

    ======= =================== ==== =================================================================
    input   ``robot_<k>_ready`` 2    cell index that the report of robot k is about, its margin [-]
    input   ``paused``          1    1 while the cell must not be left, else 0 [-]; may be left out
    output  ``current_cell``    2    index of the current cell, time at which it was entered [-, s]
    output  ``arrived``         1    1 when all robots are ready to leave the last cell, else 0 [-]
    ======= =================== ==== =================================================================

    State: one discrete group (cell index, entry time). It is updated at the start of every step of the
    simulator, so that a switch is late by at most one step; or every ``period`` where one is given.

    Args:
        robots: Number of robots N.
        cells: Number of cells of the plan.
        period: Time between updates [s], None for every step.

    Raises:
        ValueError: A count is not positive, or the period is not.
    """

    def __init__(self, robots: int, cells: int, *, period: float | None = None) -> None:
        super().__init__()
        if robots < 1 or cells < 1:
            raise ValueError(f"CellPlanner needs at least one robot and one cell, not {robots} and {cells}")
        if period is not None and not period > 0.0:
            raise ValueError(f"CellPlanner's period must be positive, not {period}")
        self._cells, self._nothing = cells, EventStatus.DidNothing()
        self._ready = tuple(
            self.DeclareVectorInputPort(f"robot_{k}_ready", READY_SIZE) for k in range(robots)
        )
        self._paused = self.DeclareVectorInputPort("paused", 1)
        self.DeclareDiscreteState([0.0, 0.0])
        # It depends on the state alone: the ready reports, which depend on it, close no algebraic loop.
        self.declare_kept("current_cell", CURRENT_CELL_SIZE)
        self.DeclareVectorOutputPort("arrived", 1, self._write_arrived)
        self.declare_update(self._advance, period)

    def _left_by_all(self, context: Context) -> float:
        """Return the index of the cell that all robots are ready to leave, -1 if some robot is not ready."""
        cell = -1.0
        for k, port in enumerate(self._ready):
            index, margin = port.Eval(context)
            # Most steps end here, at the first robot; reading the state first would cost time in every step.
            if not margin >= 0.0 or (k > 0 and index != cell):
                return -1.0
            cell = index
        return cell

    def _advance(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        cell = self._left_by_all(context)
        leaves = 0.0 <= cell < self._cells - 1 and cell == self.kept(context)[0]
        if leaves and not (self._paused.HasValue(context) and self._paused.Eval(context)[0] > 0.0):
            discrete_state.get_mutable_vector().SetFromVector([cell + 1.0, context.get_time()])
            return EventStatus.Succeeded()
        # "Did nothing" keeps the cached values that depend on the state valid.
        return self._nothing

    def _write_arrived(self, context: Context, output: BasicVector) -> None:
        cell = self.kept(context)[0]
        arrived = cell == self._cells - 1 and cell == self._left_by_all(context)
        output.SetFromVector([1.0 if arrived else 0.0])
