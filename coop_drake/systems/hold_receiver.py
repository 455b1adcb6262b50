"""What a robot hears of the hold supervisor, and that it holds by itself when it hears nothing."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.systems.block import Block
from coop_drake.systems.hold_monitor import REQUEST_SIZE


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
        self.DeclareVectorOutputPort("missed", 1, self._write_missed, {self.xd_ticket()})
        self.declare_update(self._listen, period, offset)

    def _listen(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        now, number = context.get_time(), self._message.Eval(context)[1]
        last, heard, _ = context.get_discrete_state_vector().value()
        if number != last:
            heard = now
        missed = float(now - heard > self._silence)
        discrete_state.get_mutable_vector().SetFromVector([number, heard, missed])
        return EventStatus.Succeeded()

    def _write_hold(self, context: Context, output: BasicVector) -> None:
        missed = context.get_discrete_state_vector().value()[2]
        output.SetFromVector([float(missed > 0.0 or self._message.Eval(context)[0] > 0.0)])

    def _write_missed(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state_vector().value()[2:])
