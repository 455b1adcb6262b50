"""A sensor whose clock is wrong: it measures at other instants than its robot takes it for."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.laws.measurement_errors import shift_back
from coop_drake.systems.block import Block


class ShiftedMeasurement(Block):
    """Shows what there was to measure a part of a period before, or will be after, ``shift_back``.

    ======= ============ ==== ===============================================
    input   ``exact``    n    what there is to measure
    output  ``measured`` n    the same at the instant of the wrong clock
    ======= ============ ==== ===============================================

    State: one discrete group (n), updated every period: what there was to measure then.

    Args:
        size: n.
        share: By how much earlier it is measured, in periods; may be negative [-].
        period: Time between two measurements [s].
        offset: Time of the first measurement [s].
    """

    def __init__(self, size: int, share: float, period: float, offset: float = 0.0) -> None:
        super().__init__()
        self._share, self._shift = share, shift_back
        self._exact = self.DeclareVectorInputPort("exact", size)
        self.DeclareDiscreteState(np.zeros(size))
        self.DeclareVectorOutputPort("measured", size, self._write_measured)
        self.declare_update(self._remember, period, offset)

    def _write_measured(self, context: Context, output: BasicVector) -> None:
        measured = self._exact.Eval(context).copy()
        self._shift(measured, context.get_discrete_state_vector().value().copy(), self._share)
        output.SetFromVector(measured)

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        discrete_state.get_mutable_vector().SetFromVector(self._exact.Eval(context))
        return EventStatus.Succeeded()
