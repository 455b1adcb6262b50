"""Whether one robot measures that the goal is reached, as a block."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.laws.arrival import FAR, ArrivalGoal, arrival_margin, mean_samples
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, index_of


class ArrivalMonitor(Block):
    """Averages what a robot measures in the last cell and compares it with the goal, see ``laws/arrival.py``.

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

    def __init__(self, goal: ArrivalGoal, cells: int, period: float, offset: float = 0.0) -> None:
        super().__init__()
        self._shape, self._cells = (2 * mean_samples(period), goal.place.size), cells
        self._margin = partial(arrival_margin, *goal)
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
        state, pose = context.get_discrete_state_vector().value(), self._pose.Eval(context)
        joints = self._state.Eval(context)[3 : self._shape[1]]
        discrete_state.get_mutable_vector().SetFromVector(
            np.concatenate([state[self._shape[1] :], pose, joints])
        )
        return EventStatus.Succeeded()

    def _write_arrival(self, context: Context, output: BasicVector) -> None:
        if not self._is_last(context):
            output.SetFromVector([FAR])
            return
        recent = context.get_discrete_state_vector().value().reshape(self._shape)
        output.SetFromVector([self._margin(recent, self._shape[0] - 1)])
