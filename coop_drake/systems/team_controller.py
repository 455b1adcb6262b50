"""The whole team's controllers in one stateless block."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, READY_SIZE, index_of
from coop_drake.systems.team_kernels import (
    FusedCell,
    FusedTeam,
    team_arrival,
    team_command,
    team_ready,
    team_telemetry,
)
from coop_drake.tree.pose import FloatArray

__all__ = ["TeamController", "TeamReport"]


class TeamReport(NamedTuple):
    """What the robots' own blocks would tell the log.

    Attributes:
        walls: Lower, then upper walls of all funnels, axes (theta, q...), shape (2 (1 + n),).
        acceleration: Commanded to the object, shape (3,).
        hands: Acceleration and wrench of every hand, shape (N, 6).
        bases: Poses of the bases in W, shape (N, 3).
        efforts: Wrenches on all bases in W, then all joint torques, shape (3 N + n,).
        energy_margin: Delta E.
    """

    walls: FloatArray
    acceleration: FloatArray
    hands: FloatArray
    bases: FloatArray
    efforts: FloatArray
    energy_margin: float


class TeamController(Block):
    """Computes what the controllers of all robots compute, from the plant's state, in one call.

    It is for speed alone. That robots need no state of each other is shown by the named blocks of every
    robot; here one block sees everything, with one p_G where they keep copies alike to the last bit.

    ======= ====================== =========== ======================================================== =====
    input   ``team_state``         2 (3 + n)   the plant's positions and velocities, its own order
    input   ``governor_position``  2           p_G [m]                                                  W
    input   ``current_cell``       2           index of the current cell, time of its entry [-, s]
    output  ``team_command``       3 N + n + 2 wrench on every base at Bk [N, N m], all joint torques   W, or
                                               [N m or N], p_G' [m/s]                                   Bk
    output  ``ready``              2 N         for each robot: index of the current cell, margin [-]
    ======= ====================== =========== ======================================================== =====

    No state. Base wrenches are in the axes of W, or in those of their bases where ``on_bases`` is set.

    Args:
        cells: Every cell of the plan.
        team: The robots.
        inradii: R of every transition [m].
        goal_position: Where the object shall end, shape (2,) [m].
        position_tolerance: How close to it counts as arrived [m].
        on_bases: In whose axes the wrenches are told.

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
        on_bases: bool,
    ) -> None:
        super().__init__()
        if not cells or len(cells) != len(inradii):
            raise ValueError(
                f"TeamController needs one inradius for each cell, not {len(inradii)} for {len(cells)}"
            )
        self._cells, self._on_bases = tuple(cells), on_bases
        self._laws = [(*cell, *team) for cell in cells]
        self._team, self._places = team, (team.places, team.first)
        self._leaving = [
            (cell.table, following.table, following.edges, following.gains, inradius)
            for cell, following, inradius in zip(cells, cells[1:], inradii, strict=False)
        ]
        self._arriving = cells[-1].table, np.array(goal_position, dtype=float), position_tolerance
        robots, axes = len(team.yaws), team.places.shape[1]
        self._state = self.DeclareVectorInputPort("team_state", 2 * axes)
        self._governor = self.DeclareVectorInputPort("governor_position", 2)
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self.DeclareVectorOutputPort("team_command", 3 * robots + axes - 1, self._write_command)
        self.DeclareVectorOutputPort("ready", READY_SIZE * robots, self._write_ready)

    def report(self, context: Context) -> TeamReport:
        """What the robots' own blocks would tell the log now.

        Args:
            context: Of this block.
        """
        entry = self._cell.Eval(context)
        cell, robots = self._cells[index_of(entry, len(self._cells))], len(self._team.yaws)
        axes = len(cell.table)
        report = TeamReport(
            np.empty(2 * axes), np.empty(3), np.empty((robots, 6)), np.empty((robots, 3)),
            np.empty(3 * robots + axes - 1), 0.0,
        )  # fmt: skip
        margin = team_telemetry(
            cell.gains,
            cell.edges,
            cell.table,
            *self._team,
            context.get_time() - entry[1],
            self._state.Eval(context),
            self._governor.Eval(context),
            *report[:-1],
        )
        return report._replace(energy_margin=margin)

    def _write_command(self, context: Context, output: BasicVector) -> None:
        cell = self._cell.Eval(context)
        team_command(
            *self._laws[index_of(cell, len(self._laws))],
            context.get_time() - cell[1],
            self._state.Eval(context),
            self._governor.Eval(context),
            self._on_bases,
            output.get_mutable_value(),
        )

    def _write_ready(self, context: Context, output: BasicVector) -> None:
        index = index_of(self._cell.Eval(context), len(self._cells))
        state, reports = self._state.Eval(context), output.get_mutable_value()
        if index == len(self._cells) - 1:
            team_arrival(*self._arriving, *self._places, index, state, reports)
        else:
            team_ready(
                *self._leaving[index], *self._places, index, state, self._governor.Eval(context), reports
            )
