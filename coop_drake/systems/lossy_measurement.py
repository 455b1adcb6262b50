"""A sensor's line on which measurements get lost or arrive late."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from coop_drake.laws.channels import NOTHING, carry_measurements
from coop_drake.laws.random_draws import uniform_pair
from coop_drake.laws.sampling import period_of, whole_periods
from coop_drake.systems.block import Block
from coop_drake.tree.pose import FloatArray


class LossyMeasurement(Block):
    """Passes measurements on, one each period, of which some are lost and some arrive late.

    ======= ============ ==== ===============================================================
    input   ``measured`` n    what a sensor measures now
    output  ``received`` n    the newest measurement that has arrived
    ======= ============ ==== ===============================================================

    State: one discrete group, updated every ``period``: (number of the measurement, values) of the newest
    that will have arrived by the next period, then of what arrives in each of the periods after it, with the
    number -1 where nothing does. A measurement that is lost leaves the last one standing; a late one is used
    when it arrives, unless a newer one has arrived. What is lost or late is drawn from the seed and the
    number of the period.

    Args:
        size: Size n of a measurement.
        period: Time between two measurements [s].
        loss: Probability that a measurement is lost [-].
        late: Probability that one which is not lost arrives late [-].
        late_by: How much later, rounded up to whole periods, at least one [s].
        offset: Time of the first measurement [s].
        seed: Seed of the random losses, from 0 to 2^32 - 1.

    Raises:
        ValueError: The period is not positive, the delay negative, or a probability not in [0, 1].
    """

    def __init__(
        self,
        size: int,
        period: float,
        *,
        loss: float = 0.0,
        late: float = 0.0,
        late_by: float = 0.0,
        offset: float = 0.0,
        seed: int = 0,
    ) -> None:
        super().__init__()
        if not period > 0.0 or not late_by >= 0.0:
            raise ValueError(
                f"LossyMeasurement needs a positive period and no negative delay, not {period} and {late_by}"
            )
        if not (0.0 <= loss <= 1.0 and 0.0 <= late <= 1.0):
            raise ValueError(f"LossyMeasurement's probabilities must lie in [0, 1], not {loss} and {late}")
        self._period, self._offset, self._loss, self._late, self._seed = period, offset, loss, late, seed
        self._rows = max(whole_periods(late_by, period), 1)
        self._measured = self.DeclareVectorInputPort("measured", size)
        self._kept = self.DeclareDiscreteState(self.state_at_rest(np.zeros(size)))
        self.DeclareVectorOutputPort("received", size, self._write_received)
        self.DeclarePeriodicDiscreteUpdateEvent(period_sec=period, offset_sec=offset, update=self._receive)

    def state_at_rest(self, value: FloatArray) -> FloatArray:
        """Return the state when measurements have always been ``value``, shape (n,)."""
        return np.tile([NOTHING, *value], self._rows)

    def _thrown(self, context: Context) -> tuple[int, bool, bool]:
        """Return the number of the present measurement, whether it is lost, and whether it is late if not."""
        number = period_of(context.get_time(), self._period, self._offset)
        lost, late = uniform_pair(self._seed, number)
        return number, lost < self._loss, late < self._late

    def _receive(self, context: Context, discrete_state: DiscreteValues) -> None:
        kept = context.get_discrete_state_vector().value().reshape(self._rows, -1)
        number, lost, late = self._thrown(context)
        following = np.empty_like(kept)
        carry_measurements(kept, number, self._measured.Eval(context), lost, late, following)
        discrete_state.get_mutable_vector().SetFromVector(following.ravel())

    def _write_received(self, context: Context, output: BasicVector) -> None:
        _, lost, late = self._thrown(context)
        if lost or late:
            row = context.get_discrete_state_vector().value()[: 1 + output.size()]
            output.SetFromVector(row[1:])
        else:
            output.SetFromVector(self._measured.Eval(context))
