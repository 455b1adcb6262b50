"""Prescribed performance control of the object's angle and of the joints, and their nominal motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.answers.plan import Plan
from coop_drake.laws.axis_table import (
    FADING_TIME,
    axis_table,
    first_jumps,
    track_axes,
    write_bounds,
    write_jumps,
)
from coop_drake.laws.gains import TransitionGains
from coop_drake.laws.ppc import Funnel
from coop_drake.systems.block import CLOCK_SIZE, CURRENT_CELL_SIZE, READY_SIZE, Block, clock_of, index_of
from coop_drake.tree.arrays import FloatArray


@dataclass(frozen=True)
class AxisLaw:
    """Prescribed performance control of m axes in one cell.

    Attributes:
        funnel: Funnels of these axes, from the cell's slice to the transition's goal intervals.
        gains: Gains of the transition, per-axis arrays of shape (m,).
    """

    funnel: Funnel
    gains: TransitionGains

    @cached_property
    def table(self) -> FloatArray:
        """The ``axis_table`` of these axes, shape (m, ``LAW_COLUMNS``)."""
        return axis_table(self.funnel, self.gains)

    @property
    def axes(self) -> int:
        """Number of axes m."""
        return int(self.funnel.goal_lower.size)


def axis_laws(plan: Plan, axes: Sequence[int]) -> tuple[AxisLaw, ...]:
    """Return the laws of some axes in every cell of a plan.

    Args:
        plan: The plan.
        axes: Indices into (theta, q...), in the order wanted.

    Raises:
        ValueError: The plan has no such axis.
    """
    count = len(plan.joint_names) + 1
    if any(not 0 <= axis < count for axis in axes):
        raise ValueError(f"axes {list(axes)} are not all in 0 to {count - 1}, the axes of the plan")
    chosen = np.array(axes, dtype=np.intp)
    return tuple(
        AxisLaw(plan.funnel(index).select(chosen), transition.gains.select(chosen))
        for index, transition in enumerate(plan.transitions)
    )


class AxisPpc(Block):
    """Keeps the object's angle and every joint of one robot in their funnels: (17)-(20) and (35)-(39).

    ======= ======================== ========== ====================================================== =====
    input   ``object_state``         6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``current_cell``         2          index of the current cell, time of its entry [-, s]
    input   ``ready``                2          the robot's own report: cell index, margin [-]
    input   ``clock``                3          the funnels' clock: its lag since entry [s], its pace [-]
                                                and its derivative [1/s]; only where ``paced``
    output  ``axis_acceleration``    1 + n      desired angular acceleration of the object [rad/s^2],  W
                                                of the joints [rad/s^2 or m/s^2]
    output  ``funnels``              2 (1 + n)  lower, then upper funnel bounds now [rad or m]
    ======= ======================== ========== ====================================================== =====

    State: one discrete group (index of a cell, jumps of the accelerations at the switch to it). As long as
    the robot reports that it is ready, the jumps of a switch now are written there, at the start of every
    step of the simulator or every ``period``. In the cell they fade, see ``track_axes``.

    The law is the same for all axes, so one block computes all axes of a robot; ``robot_state`` is not read
    where the robot has no joints, ``ready`` not where there is one cell.

    Args:
        laws: One law of the axes (theta, q_k) for each cell of the plan.
        start: Where the axes rest at the beginning, shape (1 + n,); None for accelerations that are those of
            the first cell's law from the beginning.
        period: Time between updates [s], None for every step.
        offset: Time of the first update where there is a period [s].
        paced: Whether the funnels move by a clock that may slow down.

    Raises:
        ValueError: There is no law, or the laws differ in their number of axes or have none.
    """

    def __init__(
        self,
        laws: Sequence[AxisLaw],
        *,
        start: FloatArray | None = None,
        period: float | None = None,
        offset: float = 0.0,
        paced: bool = False,
    ) -> None:
        super().__init__()
        if not laws or len({law.axes for law in laws}) != 1 or laws[0].axes < 1:
            raise ValueError("AxisPpc needs one law for each cell, all of the same axes, the angle first")
        self._tables = [law.table for law in laws]
        self._track = [partial(track_axes, table) for table in self._tables]
        self._bounds = [partial(write_bounds, table) for table in self._tables]
        axes = laws[0].axes
        self._fading = [float(table[0, FADING_TIME]) for table in self._tables]
        self._none, self._nothing = np.zeros(axes), EventStatus.DidNothing()
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (2 + axes))
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._ready = self.DeclareVectorInputPort("ready", READY_SIZE)
        self._clock = self.DeclareVectorInputPort("clock", CLOCK_SIZE) if paced else None
        self.DeclareDiscreteState(self.state_at_rest(0, start))
        timed = [self._cell, self._clock] if self._clock is not None else [self._cell]
        read = {self.time_ticket(), *(self.input_port_ticket(port.get_index()) for port in timed)}
        states = {self.input_port_ticket(port.get_index()) for port in (self._object, self._robot)}
        # The robot's report is not among them: only the update reads it.
        self.DeclareVectorOutputPort(
            "axis_acceleration", axes, self._write_acceleration, read | states | {self.xd_ticket()}
        )
        self.DeclareVectorOutputPort("funnels", 2 * axes, self._write_funnels, read)
        if len(laws) > 1:
            self.declare_update(self._remember, period, offset)

    def state_at_rest(self, cell: int, axes: FloatArray | None) -> FloatArray:
        """Return the state where a cell is begun at rest at these axes; None for no jumps."""
        return np.array([cell, *first_jumps(self._tables[cell], axes)])

    def _states(self, context: Context, axes: int) -> tuple[FloatArray, FloatArray]:
        object_state = self._object.Eval(context)
        return object_state, self._robot.Eval(context) if axes > 1 else object_state

    def _jumps(self, context: Context, index: int, time: float) -> FloatArray:
        """Return the jumps that fade in a cell ``time`` [s] after its entry, shape (1 + n,)."""
        if time >= self._fading[index]:  # To read the state in vain would take as long as the law.
            return self._none
        memory = self.kept(context)
        return memory[1:] if memory[0] == index else self._none

    def _write_acceleration(self, context: Context, output: BasicVector) -> None:
        cell, clock = self._cell.Eval(context), clock_of(self._clock, context)
        index, time = index_of(cell, len(self._track)), context.get_time() - cell[1]
        jumps = self._jumps(context, index, time)
        states = self._states(context, len(jumps))
        self._track[index](time, clock, jumps, *states, output.get_mutable_value())

    def _write_funnels(self, context: Context, output: BasicVector) -> None:
        cell = self._cell.Eval(context)
        write = self._bounds[index_of(cell, len(self._bounds))]
        lag = clock_of(self._clock, context)[0]
        write(context.get_time() - cell[1] - lag, output.get_mutable_value())

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        index, margin = self._ready.Eval(context)
        following = int(index) + 1
        if not margin >= 0.0 or following >= len(self._tables):
            return self._nothing
        time, table = context.get_time() - self._cell.Eval(context)[1], self._tables[following - 1]
        memory = discrete_state.get_mutable_vector().get_mutable_value()
        memory[0] = following
        states, clock = self._states(context, len(table)), clock_of(self._clock, context)
        write_jumps(table, self._tables[following], time, clock, *states, memory[1:])
        return EventStatus.Succeeded()
