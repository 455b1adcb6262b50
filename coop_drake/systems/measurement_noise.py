"""Errors of a sensor that measures once in every control period."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.laws.measurement_errors import write_errors
from coop_drake.laws.sampling import period_of
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


class MeasurementNoise(Block):
    """Adds normal noise and square waves to what a sensor measures; they change when a period begins.

    ======= ============ ==== ====================================
    input   ``exact``    n    what there is to measure
    output  ``measured`` n    the same with errors
    ======= ============ ==== ====================================

    No state: the noise is drawn from the seed and the number of the period.

    Args:
        deviations: Standard deviation of every component, shape (n,).
        waves: Size, length in periods and phase of every component's wave, shape (n, 3).
        period: Time between two measurements [s].
        seed: Seed of the noise, from 0 to 2^32 - 1.

    Raises:
        ValueError: The period or the length of a wave is not positive, or a deviation is negative.
    """

    def __init__(self, deviations: FloatArray, waves: FloatArray, period: float, seed: int) -> None:
        super().__init__()
        if not period > 0.0 or not (deviations >= 0.0).all() or not (waves[:, 1] > 0.0).all():
            given = f"{period}, {deviations} and {waves[:, 1]}"
            raise ValueError(
                "MeasurementNoise needs a positive period, no negative deviation and waves of positive "
                f"length, not {given}"
            )
        self._period, n = period, len(deviations)
        sizes = np.array(deviations, dtype=float), np.array(waves, dtype=float)
        self._errors, self._write = np.empty(n), partial(write_errors, seed, *sizes)
        self._exact = self.DeclareVectorInputPort("exact", n)
        self.DeclareVectorOutputPort("measured", n, self._write_measured)

    def _write_measured(self, context: Context, output: BasicVector) -> None:
        self._write(period_of(context.get_time(), self._period), self._errors)
        output.set_value(self._exact.Eval(context) + self._errors)
