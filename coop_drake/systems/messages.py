"""What robots and supervisor say to each other: channels, failures, and the link to a world elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Protocol

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from coop_drake.laws.measurements import (
    NOTHING,
    carry_reports,
    channel_rows,
    period_of,
    uniform_pair,
    whole_periods,
)
from coop_drake.systems.block import READY_SIZE, Block
from coop_drake.tree.arrays import FloatArray


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
        self._period, self._loss, self._repeat, self._seed = period, loss, repeat, seed
        self._delay = whole_periods(delay, period)
        self._sent = self.DeclareVectorInputPort("sent", READY_SIZE)
        kept = np.full((channel_rows(self._delay), READY_SIZE), NOTHING)
        self.DeclareDiscreteState(kept.ravel())
        self.declare_kept("heard", READY_SIZE)
        self.declare_update(self._transmit, period)

    def _transmit(self, context: Context, discrete_state: DiscreteValues) -> None:
        kept = self.kept(context).reshape(-1, READY_SIZE)
        arrivals = discrete_state.get_mutable_vector().get_mutable_value().reshape(-1, READY_SIZE)
        carry_reports(kept, self._sent.Eval(context), *self._thrown(context), self._delay, arrivals)

    def _thrown(self, context: Context) -> tuple[bool, bool]:
        """Return whether a report arrives, and whether it is repeated, drawn with their probabilities."""
        if self._loss == 0.0 and self._repeat == 0.0:
            return True, False
        lost, repeated = uniform_pair(self._seed, period_of(context.get_time(), self._period))
        return lost >= self._loss, repeated < self._repeat


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
        self.declare_update(self._remember, period, offset)

    def _fails(self, context: Context) -> bool:
        return self._begin <= context.get_time() < self._end

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> None:
        if not self._fails(context):
            discrete_state.get_mutable_vector().SetFromVector(self._wanted.Eval(context))

    def _write_given(self, context: Context, output: BasicVector) -> None:
        if not self._fails(context):
            output.SetFromVector(self._wanted.Eval(context))
        elif self._held:
            output.SetFromVector(self.kept(context))
        else:
            output.SetFromVector(np.zeros(output.size()))


class Exchange(Protocol):
    """What carries measurements, efforts and what is logged between the world, robots and the supervisor."""

    def step(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None = None
    ) -> Sequence[FloatArray]:
        """Hand over a sample, for which everybody computes once, and return the effort of every robot.

        Args:
            time: Time of the sample [s].
            measured: For every robot its own state and the object's pose as it measures them, shape
                (2 (3 + n_k) + 3,).
            stamps: For every robot when the pose and the state were measured, shape (2,) [s]; None for now.
        """
        ...

    def trouble(self) -> str:
        """Return why the run cannot go on, such as who is missing since when; empty where it can."""
        ...

    def stopped(self) -> bool:
        """Return whether the drives brake, or the team returns to its cell: nobody follows the plan then."""
        ...

    def look(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None = None
    ) -> FloatArray:
        """Return what everybody would log at an instant: all robots' records, then the supervisor's."""
        ...


class TeamLink(Block):
    """Stands for the robots' controllers and the supervisor in the Diagram of a world.

    ======= ============================ ========== ========================================================
    input   ``robot_<k>_state``          2(3+n_k)   own state of robot k as it measures it
    input   ``robot_<k>_object_pose``    3          the object's pose as robot k measures it
    input   ``robot_<k>_pose_stamp``     1          when that pose was measured [s]
    input   ``robot_<k>_state_stamp``    1          when that state was measured [s]
    output  ``robot_<k>_effort_command`` 3 + n_k    what robot k asked for in the last sample, held
    output  ``records``                             records of all robots, then that of the supervisor
    ======= ============================ ========== ========================================================

    State: one discrete group, the efforts, updated every ``period``, when all measurements go out.

    Args:
        joints: Number of joints of every robot.
        period: Control period [s].
        exchange: Carries what is exchanged.
        record_size: Size of ``records``.
    """

    def __init__(self, joints: Sequence[int], period: float, exchange: Exchange, record_size: int) -> None:
        super().__init__()
        self._exchange = exchange
        sizes = [3 + n for n in joints]
        states = [self.DeclareVectorInputPort(f"robot_{k}_state", 2 * size) for k, size in enumerate(sizes)]
        poses = [self.DeclareVectorInputPort(f"robot_{k}_object_pose", 3) for k in range(len(sizes))]
        self._inputs = [*zip(states, poses, strict=True)]
        stamped = [
            [self.DeclareVectorInputPort(f"robot_{k}_{part}_stamp", 1) for k in range(len(sizes))]
            for part in ("pose", "state")
        ]
        self._stamps = [*zip(*stamped, strict=True)]
        self.DeclareDiscreteState(np.zeros(sum(sizes)))
        ends = np.cumsum(sizes)
        for k, (size, end) in enumerate(zip(sizes, ends, strict=True)):
            self.declare_kept(f"robot_{k}_effort_command", size, first=int(end) - size)
        self.DeclareVectorOutputPort("records", record_size, self._write_records)
        self.declare_update(self._sample, period)

    @property
    def trouble(self) -> str:
        """Why the run cannot go on; empty where it can."""
        return self._exchange.trouble()

    @property
    def stopped(self) -> bool:
        """Whether the drives brake, or the team returns to its cell: nobody follows the plan then."""
        return self._exchange.stopped()

    def _given(self, context: Context) -> tuple[list[FloatArray], list[FloatArray]]:
        """Return what every robot measures, and when it measured that."""
        measured, stamps = (
            [np.concatenate([port.Eval(context) for port in ports]) for ports in robots]
            for robots in (self._inputs, self._stamps)
        )
        return measured, stamps

    def _sample(self, context: Context, discrete_state: DiscreteValues) -> None:
        efforts = self._exchange.step(context.get_time(), *self._given(context))
        discrete_state.get_mutable_vector().SetFromVector(np.concatenate(efforts))

    def _write_records(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._exchange.look(context.get_time(), *self._given(context)))
