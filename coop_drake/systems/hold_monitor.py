"""One robot's request that the team be held, when it sees that it leaves what its cell allows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.laws.axis_table import ENERGY_BOUND, track_paced_row
from coop_drake.systems.axis_laws import AxisLaw
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, index_of
from coop_drake.systems.departure_monitor import ALARM_SIZE
from coop_drake.systems.funnel_clock import CLOCK_SIZE

REQUEST_SIZE = 2
"""Size of a request: 1 to be held, 2 where the drives shall brake, else 0 [-], and the number of the message
[-], new for a new one."""

RELEASE = 0.5
"""A request ends when all energies are below this share of the limit [-], so that noise does not
begin a second one at once."""


class HoldMonitor(Block):
    """Asks for a hold while an energy is too large, Delta E negative, an alarm rings, or it hears nothing.

    ======= =================== ========== ====================================================== =====
    input   ``object_state``    6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``     2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``current_cell``    2          index of the current cell, time of its entry [-, s]
    input   ``clock``           3          lag, pace and its derivative of the funnels' clock
    input   ``energy_margin``   1          Delta E [m^2/s^2]
    input   ``missed``          1          1 where it misses messages of the supervisor, else 0 [-]
    input   ``alarm``           3          what ``DepartureMonitor`` says; only with ``alarmed``
    output  ``hold_request``    2          1 to be held, 2 for brakes, else 0; number of the message [-]
    ======= =================== ========== ====================================================== =====

    State: one discrete group, whether it asks now and how many times it has updated, every step or every
    ``period``. The request and that a message arrives are all that others hear.

    Args:
        laws: Laws of the axes (theta, q_k), one for each cell of the plan.
        energy: Largest V of an axis over the bound with which its cell may be entered [-]; None to ask only
            where messages are missed.
        alarmed: Whether a monitor of departures asks, too.
        period: Time between updates [s], None for every step.
        offset: Time of the first update [s].
    """

    def __init__(
        self,
        laws: Sequence[AxisLaw],
        energy: float | None,
        *,
        alarmed: bool = False,
        period: float | None = None,
        offset: float = 0.0,
    ) -> None:
        super().__init__()
        self._tables, self._energy = [law.table for law in laws], energy
        axes = laws[0].axes
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (2 + axes))
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._clock = self.DeclareVectorInputPort("clock", CLOCK_SIZE)
        self._margin = self.DeclareVectorInputPort("energy_margin", 1)
        self._missed = self.DeclareVectorInputPort("missed", 1)
        self._alarm = self.DeclareVectorInputPort("alarm", ALARM_SIZE) if alarmed else None
        self.DeclareDiscreteState(np.zeros(REQUEST_SIZE))
        self.DeclareVectorOutputPort("hold_request", REQUEST_SIZE, self._write_request, {self.xd_ticket()})
        self.declare_update(self._judge, period, offset)

    def _judge(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        asked, number = context.get_discrete_state_vector().value()
        asks = float(self._missed.Eval(context)[0] > 0.0)
        if self._energy is not None and not asks:
            limit = self._energy * (RELEASE if asked else 1.0)
            asks = float(self._margin.Eval(context)[0] < 0.0 or self._largest_share(context) > limit)
        if self._alarm is not None:
            asks = max(asks, float(self._alarm.Eval(context)[0]))
        discrete_state.get_mutable_vector().SetFromVector([asks, number + 1.0])
        return EventStatus.Succeeded()

    def _largest_share(self, context: Context) -> float:
        """Return the largest V of an axis over its bound."""
        cell, clock = self._cell.Eval(context), self._clock.Eval(context)
        table, time = self._tables[index_of(cell, len(self._tables))], context.get_time() - cell[1] - clock[0]
        state, robot, n = self._object.Eval(context), self._robot.Eval(context), len(self._tables[0]) - 1
        positions, rates = [state[2], *robot[3 : 3 + n]], [state[5], *robot[6 + n :]]
        return max(
            track_paced_row(row, time, clock[1], clock[2], x, rate)[1] / row[ENERGY_BOUND]
            for row, x, rate in zip(table, positions, rates, strict=True)
        )

    def _write_request(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state_vector().value())
