"""A radio channel that loses, delays and repeats what it carries."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from coop_drake.systems.current_cell import READY_SIZE

__all__ = ["MessageChannel"]

Report = tuple[float, float]

_NOTHING: Report = (-1.0, -1.0)
"""Heard before the first report arrives: it is about no cell, so it never counts."""


@dataclass
class _Air:
    """What the channel keeps.

    Attributes:
        heard: The report that arrived last.
        under_way: Reports on their way: the periods of their arrival and of their sending, and the report.
        dice: Decide what is lost or repeated.
    """

    heard: Report
    under_way: list[tuple[int, int, Report]]
    dice: np.random.Generator


class MessageChannel(LeafSystem):
    """Carries ready reports from one robot to the cell planner, one each period.

    ======= ============ ==== ================================================================
    input   ``sent``     2    cell index that the robot speaks of, margin of readiness [-]
    output  ``heard``    2    the report that arrived last; (-1, -1) before the first
    ======= ============ ==== ================================================================

    State: one abstract value, the reports under way and the dice. It is updated every ``period``. A lost
    report leaves the last one standing; a repeated one arrives again one delay (at least one period) later,
    when it may be stale.

    Args:
        period: Time between two reports [s].
        delay: Time that a report travels, rounded up to whole periods [s].
        loss: Probability that a report is lost [-].
        repeat: Probability that a report which is not lost arrives twice [-].
        seed: Of the dice.

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
        self._delay = whole_periods(delay, period)
        self._sent = self.DeclareVectorInputPort("sent", READY_SIZE)
        self._air = self.DeclareAbstractState(Value(_Air(_NOTHING, [], np.random.default_rng(seed))))
        self.DeclareVectorOutputPort("heard", READY_SIZE, self._write_heard, {self.xa_ticket()})
        self.DeclarePeriodicUnrestrictedUpdateEvent(period_sec=period, offset_sec=0.0, update=self._transmit)

    def _transmit(self, context: Context, state: State) -> EventStatus:
        before = context.get_abstract_state(int(self._air)).get_value()
        air = _Air(before.heard, list(before.under_way), copy.deepcopy(before.dice))
        now, (index, margin) = round(context.get_time() / self._period), self._sent.Eval(context)
        lost, repeated = air.dice.random(2) < (self._loss, self._repeat)
        if not lost:
            air.under_way.append((now + self._delay, now, (index, margin)))
            if repeated:
                air.under_way.append((now + self._delay + max(self._delay, 1), now, (index, margin)))
        arrived = [entry for entry in air.under_way if entry[0] <= now]
        air.under_way = [entry for entry in air.under_way if entry[0] > now]
        if arrived:
            air.heard = max(arrived)[2]  # of those that arrive together, the one that was sent last
        state.get_mutable_abstract_state(int(self._air)).set_value(air)
        return EventStatus.Succeeded()

    def _write_heard(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_abstract_state(int(self._air)).get_value().heard)


def whole_periods(time: float, period: float) -> int:
    """How many periods a time takes, rounded up but for rounding errors."""
    return int(np.ceil(time / period - 1e-9))
