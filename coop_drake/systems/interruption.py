"""A signal that fails for a while."""

from __future__ import annotations

from math import inf

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from coop_drake.systems.block import Block


class Interruption(Block):
    """Passes a signal on, but for an interval of time in which its last sample is held, or it is zero.

    ======= ========== ==== =====================================================
    input   ``wanted`` n    the signal
    output  ``given``  n    the signal, its last sample before the interval, or 0
    ======= ========== ==== =====================================================

    State: one discrete group, updated every ``period`` outside the interval: the signal's last sample.

    Args:
        size: Size n of the signal.
        period: Time between two samples [s].
        begin: When the interval begins [s].
        duration: How long it lasts [s]; None for ever.
        held: Whether the last sample is held; otherwise zero.
        offset: Time of the first sample [s].
        before: Every component of the signal before the first sample.

    Raises:
        ValueError: The period or the duration is not positive.
    """

    def __init__(
        self,
        size: int,
        period: float,
        *,
        begin: float,
        duration: float | None = None,
        held: bool = False,
        offset: float = 0.0,
        before: float = 0.0,
    ) -> None:
        super().__init__()
        if not period > 0.0 or not (duration is None or duration > 0.0):
            raise ValueError(
                f"Interruption needs a positive period and duration, not {period} and {duration}"
            )
        # A small part of a period makes up for rounding of times that are whole periods.
        self._begin, self._held = begin - 1e-6 * period, held
        self._end = inf if duration is None else self._begin + duration
        self._wanted = self.DeclareVectorInputPort("wanted", size)
        self.DeclareDiscreteState(np.full(size, before))
        self.DeclareVectorOutputPort("given", size, self._write_given)
        self.DeclarePeriodicDiscreteUpdateEvent(period_sec=period, offset_sec=offset, update=self._remember)

    def _fails(self, context: Context) -> bool:
        return self._begin <= context.get_time() < self._end

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> None:
        if not self._fails(context):
            discrete_state.get_mutable_vector().SetFromVector(self._wanted.Eval(context))

    def _write_given(self, context: Context, output: BasicVector) -> None:
        if not self._fails(context):
            output.SetFromVector(self._wanted.Eval(context))
        elif self._held:
            output.SetFromVector(context.get_discrete_state_vector().value())
        else:
            output.SetFromVector(np.zeros(output.size()))
