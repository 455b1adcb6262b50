"""Actuators whose efforts lag behind what is asked of them in every control period."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from coop_drake.laws.actuators import lag_behind
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


class LaggingEffort(Block):
    """Follows an effort that is held between samples as a first-order low pass, exactly.

    ======= ========== ==== ===================================================================
    input   ``held``   m    effort asked for, constant between samples [N, N m]
    output  ``given``  m    effort that acts [N, N m]; zero before the first sample
    ======= ========== ==== ===================================================================

    State: one discrete group, updated every ``period``: time of the last sample, the effort that acted then.

    Drake's ``FirstOrderLowPassFilter`` is integrated numerically, which takes several steps for each period
    where the time constant is about a period long.

    Args:
        size: Size m of the effort.
        lag: Time constant [s].
        period: Time between two samples [s].
        offset: Time of the first sample [s].

    Raises:
        ValueError: The lag or the period is not positive.
    """

    def __init__(self, size: int, lag: float, period: float, offset: float = 0.0) -> None:
        super().__init__()
        if not lag > 0.0 or not period > 0.0:
            raise ValueError(f"LaggingEffort needs a positive lag and period, not {lag} and {period}")
        self._follow = partial(lag_behind, lag)
        self._held = self.DeclareVectorInputPort("held", size)
        self.DeclareDiscreteState(np.zeros(1 + size))
        self.DeclareVectorOutputPort("given", size, self._write_given)
        self.declare_update(self._remember, period, offset)

    def _write_given(self, context: Context, output: BasicVector) -> None:
        self._write(context, output.get_mutable_value())

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> None:
        following = discrete_state.get_mutable_vector().get_mutable_value()
        following[0] = context.get_time()
        self._write(context, following[1:])

    def _write(self, context: Context, given: FloatArray) -> None:
        state = context.get_discrete_state_vector().value()
        elapsed = context.get_time() - float(state[0])
        self._follow(elapsed, self._held.Eval(context), state[1:], given)
