"""Holding the team: who asks for it, who decides, who hears, and the clock that stands still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.laws.axis_table import ENERGY_BOUND, track_row
from coop_drake.laws.ppc import SETTLING_TIME, lagging_clock
from coop_drake.systems.block import CLOCK_SIZE, CURRENT_CELL_SIZE, REQUEST_SIZE, Block, index_of
from coop_drake.systems.ppc import AxisLaw

RELEASE = 0.5
"""A request ends when all energies are below this share of the limit [-], so that noise does not
begin a second one at once."""


class HoldMonitor(Block):
    """Asks for a hold while an energy is too large, Delta E is negative, or it hears nothing.

    ======= =================== ========== ====================================================== =====
    input   ``object_state``    6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``     2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``current_cell``    2          index of the current cell, time of its entry [-, s]
    input   ``clock``           3          lag, pace and its derivative of the funnels' clock
    input   ``energy_margin``   1          Delta E [m^2/s^2]
    input   ``missed``          1          1 where it misses messages of the supervisor, else 0 [-]
    output  ``hold_request``    2          1 to be held, else 0; the number of the message [-]
    ======= =================== ========== ====================================================== =====

    State: one discrete group, whether it asks now and how many times it has updated, every step or every
    ``period``. The request and that a message arrives are all that others hear.

    Args:
        laws: Laws of the axes (theta, q_k), one for each cell of the plan.
        energy: Largest V of an axis over the bound with which its cell may be entered [-]; None to ask only
            where messages are missed.
        period: Time between updates [s], None for every step.
        offset: Time of the first update [s].
    """

    def __init__(
        self,
        laws: Sequence[AxisLaw],
        energy: float | None,
        *,
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
        self.DeclareDiscreteState(np.zeros(REQUEST_SIZE))
        self.declare_kept("hold_request", REQUEST_SIZE)
        self.declare_update(self._judge, period, offset)

    def _judge(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        asked, number = self.kept(context)
        asks = float(self._missed.Eval(context)[0] > 0.0)
        if self._energy is not None and not asks:
            limit = self._energy * (RELEASE if asked else 1.0)
            asks = float(self._margin.Eval(context)[0] < 0.0 or self._largest_share(context) > limit)
        discrete_state.get_mutable_vector().SetFromVector([asks, number + 1.0])
        return EventStatus.Succeeded()

    def _largest_share(self, context: Context) -> float:
        """Return the largest V of an axis over its bound."""
        cell, clock = self._cell.Eval(context), self._clock.Eval(context)
        table, time = self._tables[index_of(cell, len(self._tables))], context.get_time() - cell[1] - clock[0]
        state, robot, n = self._object.Eval(context), self._robot.Eval(context), len(self._tables[0]) - 1
        positions, rates = [state[2], *robot[3 : 3 + n]], [state[5], *robot[6 + n :]]
        return max(
            track_row(row, time, x, rate, clock[1], clock[2])[1] / row[ENERGY_BOUND]
            for row, x, rate in zip(table, positions, rates, strict=True)
        )


class HoldReceiver(Block):
    """Passes the supervisor's bit on; holds the robot where no new message came for too long.

    ======= ================ ==== ======================================================================
    input   ``hold_message`` 2    1 where the team is held, else 0 [-]; the number of the message [-]
    output  ``hold``         1    1 where the robot holds, else 0 [-]
    output  ``missed``       1    1 where no message came for too long, else 0 [-]
    ======= ================ ==== ======================================================================

    State: one discrete group, updated every step or every ``period``: the number of the last message, the
    time at which it arrived [s], and ``missed``.

    Args:
        silence: Longest time without a new message [s]; None to wait for ever.
        period: Time between updates [s], None for every step.
        offset: Time of the first update [s].
    """

    def __init__(
        self, silence: float | None = None, *, period: float | None = None, offset: float = 0.0
    ) -> None:
        super().__init__()
        self._silence = np.inf if silence is None else silence
        self._message = self.DeclareVectorInputPort("hold_message", REQUEST_SIZE)
        self.DeclareDiscreteState(np.array([-1.0, 0.0, 0.0]))
        self.DeclareVectorOutputPort("hold", 1, self._write_hold)
        self.declare_kept("missed", 1, first=2)
        self.declare_update(self._listen, period, offset)

    def _listen(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        now, number = context.get_time(), self._message.Eval(context)[1]
        last, heard, _ = self.kept(context)
        if number != last:
            heard = now
        missed = float(now - heard > self._silence)
        discrete_state.get_mutable_vector().SetFromVector([number, heard, missed])
        return EventStatus.Succeeded()

    def _write_hold(self, context: Context, output: BasicVector) -> None:
        missed = self.kept(context)[2]
        output.SetFromVector([float(missed > 0.0 or self._message.Eval(context)[0] > 0.0)])


# The supervisor that holds the team: when it is told to, a robot asks for it, or a robot is not heard.

TOLD, ASKED, SILENT, BRAKED = 1.0, 2.0, 3.0, 4.0
"""Causes of a hold, and of drives that brake: an order; a robot asks, is not heard, or lets them brake."""


class HoldSupervisor(Block):
    """Holds the team while there is a cause, and tells all robots by one bit.

    ======= ===================== ===== ================================================================
    input   ``order``             1     1 where the team is told to hold, else 0 [-]
    input   ``robot_<k>_request`` 2     the request of robot k that arrived last, see ``HoldMonitor``
    output  ``hold``              1     1 where the team is held, else 0 [-]
    output  ``hold_message``      2     the same for the robots, and the number of the message, which tells
                                        them that it is a new one [-]
    output  ``paused``            1     1 while the funnels' clock does not run as usual, else 0: the
                                        cell must not be left [-]
    output  ``causes``            1 + N first the order (0, or 1 where the team is told to hold), then each
                                        robot: 0 for no cause, 2 where it asks, 3 where it is not heard [-]
    ======= ===================== ===== ================================================================

    State: one discrete group, updated at the start of every step, or every ``period``: the time at which the
    last hold ended, the causes, for each robot the number of its last message and the time at which that
    message arrived, and the number of the supervisor's own message.

    Args:
        robots: Number of robots N.
        silence: Longest time without a new message of a robot [s]; None to wait for ever.
        period: Time between updates [s], None for every step.
    """

    def __init__(self, robots: int, *, silence: float | None = None, period: float | None = None) -> None:
        super().__init__()
        self._silence = np.inf if silence is None else silence
        self._order = self.DeclareVectorInputPort("order", 1)
        self._requests = [
            self.DeclareVectorInputPort(f"robot_{k}_request", REQUEST_SIZE) for k in range(robots)
        ]
        self.DeclareDiscreteState(np.array([-SETTLING_TIME, *np.zeros(2 + 3 * robots)]))
        self._robots = robots
        self.DeclareVectorOutputPort("hold", 1, self._write_hold, {self.xd_ticket()})
        self.DeclareVectorOutputPort("hold_message", REQUEST_SIZE, self._write_message, {self.xd_ticket()})
        self.DeclareVectorOutputPort("paused", 1, self._write_paused, {self.xd_ticket(), self.time_ticket()})
        self.declare_kept("causes", 1 + robots, first=1)
        self.declare_update(self._decide, period)

    def _decide(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        state, now = np.array(self.kept(context)), context.get_time()
        causes, heard = state[1 : 2 + self._robots], state[2 + self._robots : -1].reshape(-1, 2)
        held = causes.any()
        causes[0] = TOLD if self._order.Eval(context)[0] > 0.0 else 0.0
        for k, port in enumerate(self._requests):
            asks, number = port.Eval(context)
            if number != heard[k, 0]:
                heard[k] = number, now
            silent = SILENT if now - heard[k, 1] > self._silence else 0.0
            causes[1 + k] = ASKED if asks > 0.0 else silent
        if held and not causes.any():
            state[0] = now
        state[-1] += 1.0
        discrete_state.get_mutable_vector().SetFromVector(state)
        return EventStatus.Succeeded()

    def _held(self, context: Context) -> bool:
        return bool(self.kept(context)[1 : 2 + self._robots].any())

    def _write_hold(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([float(self._held(context))])

    def _write_message(self, context: Context, output: BasicVector) -> None:
        number = self.kept(context)[-1]
        output.SetFromVector([float(self._held(context)), number])

    def _write_paused(self, context: Context, output: BasicVector) -> None:
        ended = self.kept(context)[0]
        paused = self._held(context) or context.get_time() - ended < SETTLING_TIME
        output.SetFromVector([float(paused)])


class FunnelClock(Block):
    """Tells by how much the funnels' time lags behind the time since a cell was entered: ``lagging_clock``.

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
        held, state = float(self._hold.Eval(context)[0]), self.kept(context)
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
        state, entry = self.kept(context), float(self._cell.Eval(context)[1])
        a, b, b_rate, lag = lagging_clock(context.get_time() - state[0], state[1], state[2:])
        if entry > state[0]:  # the cell was entered since; what was lost before does not count
            lag -= lagging_clock(entry - state[0], state[1], state[2:])[3]
        return a, b, b_rate, lag
