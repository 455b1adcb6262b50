"""The supervisor that switches to the plan's next cell when every robot is ready."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, READY_SIZE


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
        # Without these tickets the ready reports, which depend on the cell, would close an algebraic loop.
        self.DeclareVectorOutputPort("current_cell", CURRENT_CELL_SIZE, self._write_cell, {self.xd_ticket()})
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
        leaves = 0.0 <= cell < self._cells - 1 and cell == context.get_discrete_state_vector().value()[0]
        if leaves and not (self._paused.HasValue(context) and self._paused.Eval(context)[0] > 0.0):
            discrete_state.get_mutable_vector().SetFromVector([cell + 1.0, context.get_time()])
            return EventStatus.Succeeded()
        # "Did nothing" keeps the cached values that depend on the state valid.
        return self._nothing

    def _write_cell(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state_vector().value())

    def _write_arrived(self, context: Context, output: BasicVector) -> None:
        cell = context.get_discrete_state_vector().value()[0]
        arrived = cell == self._cells - 1 and cell == self._left_by_all(context)
        output.SetFromVector([1.0 if arrived else 0.0])
