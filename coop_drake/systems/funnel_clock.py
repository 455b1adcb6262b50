"""The clock of a robot's funnels, which stands still while the team is held."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus, InputPort

from coop_drake.laws.hold import lagging_clock
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE
from coop_drake.tree.pose import FloatArray

CLOCK_SIZE = 3
"""Size of a clock's output: lag [s], pace [-] and its derivative [1/s]."""

_ON_TIME = np.array([0.0, 1.0, 0.0])


def clock_of(port: InputPort | None, context: Context) -> FloatArray:
    """Return the value of a ``clock`` port, or (0, 1, 0) where a block has none."""
    return _ON_TIME if port is None else port.Eval(context)


class FunnelClock(Block):
    """Tells by how much the funnels' time lags behind the time since a cell was entered, see ``laws.hold``.

    ======= ================ ==== ====================================================================
    input   ``hold``         1    1 where the team is held, else 0 [-]
    input   ``current_cell`` 2    index of the current cell, time of its entry [-, s]
    output  ``clock``        3    lag since the cell was entered [s], pace [-], the pace's derivative
                                  [1/s]; (0, 1, 0) where the team was never held
    ======= ================ ==== ====================================================================

    State: one discrete group, updated at the start of every step, or every ``period``, in which ``hold``
    changes: the time of the change, ``hold`` from then on, and a, b and the lag at that time. All robots that
    hear the same bits have the same clock, to the last bit.

    Args:
        period: Time between updates [s], None for every step.
        offset: Time of the first update [s].
    """

    def __init__(self, period: float | None = None, offset: float = 0.0) -> None:
        super().__init__()
        self._nothing = EventStatus.DidNothing()
        self._hold = self.DeclareVectorInputPort("hold", 1)
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self.DeclareDiscreteState(np.zeros(5))
        entered = self.input_port_ticket(self._cell.get_index())
        tickets = {self.time_ticket(), self.xd_ticket(), entered}
        self.DeclareVectorOutputPort("clock", CLOCK_SIZE, self._write_clock, tickets)
        self.declare_update(self._follow, period, offset)

    def _follow(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        held, state = float(self._hold.Eval(context)[0]), context.get_discrete_state_vector().value()
        if held == state[1]:
            return self._nothing
        a, b, _, lag = self._now(context)
        discrete_state.get_mutable_vector().SetFromVector([context.get_time(), held, a, b, lag])
        return EventStatus.Succeeded()

    def _write_clock(self, context: Context, output: BasicVector) -> None:
        _, b, b_rate, lag = self._now(context)
        output.SetFromVector([lag, 1.0 - b, -b_rate])

    def _now(self, context: Context) -> tuple[float, float, float, float]:
        """Return a, b, b' and the lag since the current cell was entered."""
        state, entry = context.get_discrete_state_vector().value(), float(self._cell.Eval(context)[1])
        a, b, b_rate, lag = lagging_clock(context.get_time() - state[0], state[1], state[2:])
        if entry > state[0]:  # the cell was entered since; what was lost before does not count
            lag -= lagging_clock(entry - state[0], state[1], state[2:])[3]
        return a, b, b_rate, lag
