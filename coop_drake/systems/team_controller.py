"""The whole team's controllers in one block."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.compiled import prepared
from coop_drake.laws.axis_table import first_jumps
from coop_drake.systems.block import NUMBER, VECTOR, Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, READY_SIZE, index_of
from coop_drake.systems.funnel_clock import CLOCK_SIZE, clock_of
from coop_drake.systems.jump_memory import JumpMemory
from coop_drake.systems.ready_kernels import ready_conditions
from coop_drake.systems.team_kernels import (
    FusedCell,
    FusedTeam,
    drive_team,
    remember_jumps,
    report_readiness,
    telemetry_size,
)
from coop_drake.tree.pose import FloatArray


class TeamController(Block):
    """Computes in continuous time what the controllers of all robots compute, from the plant's state.

    It exists for speed alone, and calls for every robot the functions that the robot's own blocks call. Here
    one block sees everything, with one p_G where the robots keep copies that are equal to the last bit.

    ======= ====================== ============= ====================================================== =====
    input   ``team_state``         2 (3 + n)     the plant's positions and velocities, its own order
    input   ``governor_position``  2             p_G [m]                                                W
    input   ``current_cell``       2             index of the current cell, time of its entry [-, s]
    input   ``clock``              3             as that of ``AxisPpc``; only where ``paced``
    output  ``team_command``       3 N + n + 2   wrench on every base at Bk [N, N m], all joint torques Bk
                                                 [N m or N], p_G' [m/s]                                 W
    output  ``telemetry``          6 + 12 N + 3n what the robots' blocks show to the log, see           W
                                                 ``telemetry_parts``
    output  ``ready``              2 N           for each robot: index of the current cell, margin [-]
    ======= ====================== ============= ====================================================== =====

    State: one discrete group as that of ``AxisPpc``: index of a cell, jumps of all axes at the switch to it.

    Args:
        cells: Every cell of the plan.
        team: The robots.
        inradii: R of every transition [m].
        goal_position: Goal position of the object, shape (2,) [m].
        position_tolerance: Largest distance to it that counts as arrived [m].
        start: Where the axes of every robot, (theta, q_k), rest at the beginning, shape (N + n,).
        paced: Whether funnels and p_G move by a clock that may slow down.

    Raises:
        ValueError: There is no cell, or not one inradius for each.
    """

    def __init__(
        self,
        cells: Sequence[FusedCell],
        team: FusedTeam,
        inradii: Sequence[float],
        goal_position: FloatArray,
        position_tolerance: float,
        *,
        start: FloatArray,
        paced: bool = False,
    ) -> None:
        super().__init__()
        if not cells or len(cells) != len(inradii):
            found = f"{len(inradii)} for {len(cells)}"
            raise ValueError(f"TeamController needs one inradius for each cell, not {found}")
        ports = VECTOR, VECTOR, VECTOR, VECTOR, VECTOR, VECTOR
        self._laws = [prepared(drive_team, (*cell, *team[:-1]), NUMBER, *ports) for cell in cells]
        self._tables, edges, rows = zip(*((cell.table, cell.edges, cell.row) for cell in cells), strict=True)
        conditions = ready_conditions(self._tables, edges, rows, inradii, goal_position, position_tolerance)
        reading = team.places, team.first, team.base_chains, team.yaws
        told = 0, NUMBER, VECTOR, VECTOR, VECTOR
        self._report = [prepared(report_readiness, (*each, *reading), *told) for each in conditions]
        self._reading = reading
        self._memory, self._nothing = JumpMemory(self._tables), EventStatus.DidNothing()
        robots, joints = len(team.yaws), team.places.shape[1] - 3
        self._state = self.DeclareVectorInputPort("team_state", 2 * (3 + joints))
        self._governor = self.DeclareVectorInputPort("governor_position", 2)
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._clock = self.DeclareVectorInputPort("clock", CLOCK_SIZE) if paced else None
        sizes = 3 * robots + joints + 2, telemetry_size(robots, joints)
        self._unread = tuple(map(np.empty, sizes))
        self.DeclareVectorOutputPort("team_command", sizes[0], self._write_command)
        self.DeclareVectorOutputPort("telemetry", sizes[1], self._write_telemetry)
        self._ready = self.DeclareVectorOutputPort("ready", READY_SIZE * robots, self._write_ready)
        self.DeclareDiscreteState([0.0, *first_jumps(cells[0].table, start)])
        if len(cells) > 1:
            self.declare_update(self._remember, None)

    def _write_command(self, context: Context, output: BasicVector) -> None:
        self._drive(context, output.get_mutable_value(), self._unread[1])

    def _write_telemetry(self, context: Context, output: BasicVector) -> None:
        self._drive(context, self._unread[0], output.get_mutable_value())

    def _drive(self, context: Context, command: FloatArray, telemetry: FloatArray) -> None:
        cell = self._cell.Eval(context)
        index, time = index_of(cell, len(self._laws)), context.get_time() - cell[1]
        clock, jumps = clock_of(self._clock, context), self._memory.jumps(context, index, time)
        state, governor = self._state.Eval(context), self._governor.Eval(context)
        self._laws[index](time, clock, jumps, state, governor, command, telemetry)

    def _write_ready(self, context: Context, output: BasicVector) -> None:
        cell = self._cell.Eval(context)
        index = index_of(cell, len(self._report))
        state, governor = self._state.Eval(context), self._governor.Eval(context)
        self._report[index](index, context.get_time() - cell[1], state, governor, output.get_mutable_value())

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        reports = self._ready.Eval(context)
        if not max(reports[1::2].tolist()) >= 0.0:
            return self._nothing
        cell = self._cell.Eval(context)
        following = int(cell[0]) + 1
        if following >= len(self._tables):
            return self._nothing
        memory = discrete_state.get_mutable_vector().get_mutable_value()
        memory[0] = following
        table, next_table = self._tables[following - 1 : following + 1]
        time, state = context.get_time() - cell[1], self._state.Eval(context)
        clock = clock_of(self._clock, context)
        remember_jumps(table, next_table, *self._reading, time, clock, state, reports, memory[1:])
        return EventStatus.Succeeded()
