"""A radio channel that loses, delays and repeats what it carries."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues
from pydrake.systems.primitives import LinearSystem

from coop_drake.laws.channels import NOTHING, carry_reports, channel_rows
from coop_drake.laws.random_draws import uniform_pair
from coop_drake.laws.sampling import period_of, whole_periods
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import READY_SIZE


class MessageChannel(Block):
    """Carries ready reports from one robot to the cell planner, one each period.

    ======= ============ ==== ================================================================
    input   ``sent``     2    cell index that the robot speaks of, margin of readiness [-]
    output  ``heard``    2    the report that arrived last; (-1, -1) before the first
    ======= ============ ==== ================================================================

    State: one discrete group, updated every ``period``: the report heard, then what arrives in each of the
    next periods, (-1, -1) where nothing does. A lost report leaves the last one standing; a repeated one
    arrives again one delay (at least one period) later, unless a newer one arrives then. What is lost is
    drawn from the seed and the number of the period.

    Args:
        period: Time between two reports [s].
        delay: Time that a report travels, rounded up to whole periods [s].
        loss: Probability that a report is lost [-].
        repeat: Probability that a report which is not lost arrives twice [-].
        seed: Seed of the random losses and delays, from 0 to 2^32 - 1.

    Raises:
        ValueError: The period is not positive, the delay negative, or a probability not in [0, 1].
    """

    def __init__(
        self, period: float, *, delay: float = 0.0, loss: float = 0.0, repeat: float = 0.0, seed: int = 0
    ) -> None:
        super().__init__()
        if not period > 0.0 or not delay >= 0.0:
            raise ValueError(
                f"MessageChannel needs a positive period and no negative delay, not {period} and {delay}"
            )
        if not (0.0 <= loss <= 1.0 and 0.0 <= repeat <= 1.0):
            raise ValueError(f"MessageChannel's probabilities must lie in [0, 1], not {loss} and {repeat}")
        self._period, self._loss, self._repeat = period, loss, repeat
        self._draw = partial(uniform_pair, seed)
        self._delay = whole_periods(delay, period)
        self._sent = self.DeclareVectorInputPort("sent", READY_SIZE)
        kept = np.full((channel_rows(self._delay), READY_SIZE), NOTHING)
        self.DeclareDiscreteState(kept.ravel())
        self.DeclareVectorOutputPort("heard", READY_SIZE, self._write_heard, {self.xd_ticket()})
        self.DeclarePeriodicDiscreteUpdateEvent(period_sec=period, offset_sec=0.0, update=self._transmit)

    def _transmit(self, context: Context, discrete_state: DiscreteValues) -> None:
        kept = context.get_discrete_state_vector().value().reshape(-1, READY_SIZE)
        arrivals = discrete_state.get_mutable_vector().get_mutable_value().reshape(-1, READY_SIZE)
        carry_reports(kept, self._sent.Eval(context), *self._thrown(context), self._delay, arrivals)

    def _thrown(self, context: Context) -> tuple[bool, bool]:
        """Return whether a report arrives, and whether it is repeated, drawn with their probabilities."""
        if self._loss == 0.0 and self._repeat == 0.0:
            return True, False
        lost, repeated = self._draw(period_of(context.get_time(), self._period))
        return lost >= self._loss, repeated < self._repeat

    def _write_heard(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state_vector().value()[:READY_SIZE])


def clear_channel(period: float) -> LinearSystem:
    """Build a channel that neither loses nor delays reports: a zero-order hold, empty at first.

    Its input and output are those of :class:`MessageChannel`, reports of shape (2,), under Drake's names.

    Args:
        period: Time between two reports [s].
    """
    passed, no = np.eye(READY_SIZE), np.zeros((READY_SIZE, READY_SIZE))
    hold = LinearSystem(A=no, B=passed, C=passed, D=no, time_period=period)
    hold.configure_default_state(np.full(READY_SIZE, NOTHING))
    return hold
