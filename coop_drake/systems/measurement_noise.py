"""Noise of a sensor that measures once in every control period."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.compiled import prepared
from coop_drake.laws.random_draws import write_normals
from coop_drake.laws.sampling import period_of
from coop_drake.systems.block import VECTOR, Block
from coop_drake.tree.pose import FloatArray


class MeasurementNoise(Block):
    """Adds normal noise to what a sensor measures; the noise changes at the beginning of every period.

    ======= ============ ==== ====================================
    input   ``exact``    n    what there is to measure
    output  ``measured`` n    the same with noise
    ======= ============ ==== ====================================

    No state: the noise is drawn from the seed and the number of the period.

    Args:
        deviations: Standard deviation of every component, shape (n,).
        period: Time between two measurements [s].
        seed: Seed of the noise, from 0 to 2^32 - 1.

    Raises:
        ValueError: The period is not positive, or a deviation is negative.
    """

    def __init__(self, deviations: FloatArray, period: float, seed: int) -> None:
        super().__init__()
        if not period > 0.0 or not (deviations >= 0.0).all():
            given = f"{period} and {deviations}"
            raise ValueError(
                f"MeasurementNoise needs a positive period and no negative deviation, not {given}"
            )
        self._deviations, self._period, self._seed = np.array(deviations, dtype=float), period, seed
        self._drawn, self._draw = np.empty(len(deviations)), prepared(write_normals, [seed], 0, VECTOR)
        self._exact = self.DeclareVectorInputPort("exact", len(deviations))
        self.DeclareVectorOutputPort("measured", len(deviations), self._write_measured)

    def _write_measured(self, context: Context, output: BasicVector) -> None:
        self._draw(period_of(context.get_time(), self._period), self._drawn)
        output.set_value(self._exact.Eval(context) + self._deviations * self._drawn)
