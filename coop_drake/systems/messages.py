"""What robots and supervisor say to each other: channels, failures, holds, a link to a world elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Protocol

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.laws.axis_table import ENERGY_BOUND, track_row
from coop_drake.laws.measurements import (
    NOTHING,
    carry_reports,
    channel_rows,
    period_of,
    uniform_pair,
    whole_periods,
)
from coop_drake.laws.ppc import SETTLING_TIME, lagging_clock
from coop_drake.systems.block import CLOCK_SIZE, CURRENT_CELL_SIZE, READY_SIZE, REQUEST_SIZE, Block, index_of
from coop_drake.systems.resting import AxisLaw
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


# Holding the team: who asks for it, who decides, who hears, and the clock that stands still.


RELEASE = 0.5
"""A request ends when all energies are below this share of the limit [-], so that noise does not
begin a second one at once."""


class HoldMonitor(Block):
    """Asks for a hold while an energy is too large, Delta E is negative, or it hears nothing.

    ======= =================== ========== ====================================================== =====
    input   ``object_state``    6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``     2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``current_cell``    2          index of the current cell, time of its entry [-, s]
    input   ``clock``           3          lag, pace and its derivative of the funnels' clock
    input   ``energy_margin``   1          Delta E [m^2/s^2]
    input   ``missed``          1          1 where it misses messages of the supervisor, else 0 [-]
    output  ``hold_request``    2          1 to be held, else 0; the number of the message [-]
    ======= =================== ========== ====================================================== =====

    State: one discrete group, whether it asks now and how many times it has updated, every step or every
    ``period``. The request and that a message arrives are all that others hear.

    Args:
        laws: Laws of the axes (theta, q_k), one for each cell of the plan.
        energy: Largest V of an axis over the bound with which its cell may be entered [-]; None to ask only
            where messages are missed.
        period: Time between updates [s], None for every step.
        offset: Time of the first update [s].
    """

    def __init__(
        self,
        laws: Sequence[AxisLaw],
        energy: float | None,
        *,
        period: float | None = None,
        offset: float = 0.0,
    ) -> None:
        super().__init__()
        self._tables, self._energy = [law.table for law in laws], energy
        axes = laws[0].axes
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (2 + axes))
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._clock = self.DeclareVectorInputPort("clock", CLOCK_SIZE)
        self._margin = self.DeclareVectorInputPort("energy_margin", 1)
        self._missed = self.DeclareVectorInputPort("missed", 1)
        self.DeclareDiscreteState(np.zeros(REQUEST_SIZE))
        self.declare_kept("hold_request", REQUEST_SIZE)
        self.declare_update(self._judge, period, offset)

    def _judge(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        asked, number = self.kept(context)
        asks = float(self._missed.Eval(context)[0] > 0.0)
        if self._energy is not None and not asks:
            limit = self._energy * (RELEASE if asked else 1.0)
            asks = float(self._margin.Eval(context)[0] < 0.0 or self._largest_share(context) > limit)
        discrete_state.get_mutable_vector().SetFromVector([asks, number + 1.0])
        return EventStatus.Succeeded()

    def _largest_share(self, context: Context) -> float:
        """Return the largest V of an axis over its bound."""
        cell, clock = self._cell.Eval(context), self._clock.Eval(context)
        table, time = self._tables[index_of(cell, len(self._tables))], context.get_time() - cell[1] - clock[0]
        state, robot, n = self._object.Eval(context), self._robot.Eval(context), len(self._tables[0]) - 1
        positions, rates = [state[2], *robot[3 : 3 + n]], [state[5], *robot[6 + n :]]
        return max(
            track_row(row, time, x, rate, clock[1], clock[2])[1] / row[ENERGY_BOUND]
            for row, x, rate in zip(table, positions, rates, strict=True)
        )


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
        self.declare_kept("missed", 1, first=2)
        self.declare_update(self._listen, period, offset)

    def _listen(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        now, number = context.get_time(), self._message.Eval(context)[1]
        last, heard, _ = self.kept(context)
        if number != last:
            heard = now
        missed = float(now - heard > self._silence)
        discrete_state.get_mutable_vector().SetFromVector([number, heard, missed])
        return EventStatus.Succeeded()

    def _write_hold(self, context: Context, output: BasicVector) -> None:
        missed = self.kept(context)[2]
        output.SetFromVector([float(missed > 0.0 or self._message.Eval(context)[0] > 0.0)])


# The supervisor that holds the team: when it is told to, a robot asks for it, or a robot is not heard.

TOLD, ASKED, SILENT, BRAKED = 1.0, 2.0, 3.0, 4.0
"""Causes of a hold, and of drives that brake: an order; a robot asks, is not heard, or lets them brake."""


class HoldSupervisor(Block):
    """Holds the team while there is a cause, and tells all robots by one bit.

    ======= ===================== ===== ================================================================
    input   ``order``             1     1 where the team is told to hold, else 0 [-]
    input   ``robot_<k>_request`` 2     the request of robot k that arrived last, see ``HoldMonitor``
    output  ``hold``              1     1 where the team is held, else 0 [-]
    output  ``hold_message``      2     the same for the robots, and the number of the message, which tells
                                        them that it is a new one [-]
    output  ``paused``            1     1 while the funnels' clock does not run as usual, else 0: the
                                        cell must not be left [-]
    output  ``causes``            1 + N first the order (0, or 1 where the team is told to hold), then each
                                        robot: 0 for no cause, 2 where it asks, 3 where it is not heard [-]
    ======= ===================== ===== ================================================================

    State: one discrete group, updated at the start of every step, or every ``period``: the time at which the
    last hold ended, the causes, for each robot the number of its last message and the time at which that
    message arrived, and the number of the supervisor's own message.

    Args:
        robots: Number of robots N.
        silence: Longest time without a new message of a robot [s]; None to wait for ever.
        period: Time between updates [s], None for every step.
    """

    def __init__(self, robots: int, *, silence: float | None = None, period: float | None = None) -> None:
        super().__init__()
        self._silence = np.inf if silence is None else silence
        self._order = self.DeclareVectorInputPort("order", 1)
        self._requests = [
            self.DeclareVectorInputPort(f"robot_{k}_request", REQUEST_SIZE) for k in range(robots)
        ]
        self.DeclareDiscreteState(np.array([-SETTLING_TIME, *np.zeros(2 + 3 * robots)]))
        self._robots = robots
        self.DeclareVectorOutputPort("hold", 1, self._write_hold, {self.xd_ticket()})
        self.DeclareVectorOutputPort("hold_message", REQUEST_SIZE, self._write_message, {self.xd_ticket()})
        self.DeclareVectorOutputPort("paused", 1, self._write_paused, {self.xd_ticket(), self.time_ticket()})
        self.declare_kept("causes", 1 + robots, first=1)
        self.declare_update(self._decide, period)

    def _decide(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        state, now = np.array(self.kept(context)), context.get_time()
        causes, heard = state[1 : 2 + self._robots], state[2 + self._robots : -1].reshape(-1, 2)
        held = causes.any()
        causes[0] = TOLD if self._order.Eval(context)[0] > 0.0 else 0.0
        for k, port in enumerate(self._requests):
            asks, number = port.Eval(context)
            if number != heard[k, 0]:
                heard[k] = number, now
            silent = SILENT if now - heard[k, 1] > self._silence else 0.0
            causes[1 + k] = ASKED if asks > 0.0 else silent
        if held and not causes.any():
            state[0] = now
        state[-1] += 1.0
        discrete_state.get_mutable_vector().SetFromVector(state)
        return EventStatus.Succeeded()

    def _held(self, context: Context) -> bool:
        return bool(self.kept(context)[1 : 2 + self._robots].any())

    def _write_hold(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([float(self._held(context))])

    def _write_message(self, context: Context, output: BasicVector) -> None:
        number = self.kept(context)[-1]
        output.SetFromVector([float(self._held(context)), number])

    def _write_paused(self, context: Context, output: BasicVector) -> None:
        ended = self.kept(context)[0]
        paused = self._held(context) or context.get_time() - ended < SETTLING_TIME
        output.SetFromVector([float(paused)])


class FunnelClock(Block):
    """Tells by how much the funnels' time lags behind the time since a cell was entered: ``lagging_clock``.

    ======= ================ ==== ====================================================================
    input   ``hold``         1    1 where the team is held, else 0 [-]
    input   ``current_cell`` 2    index of the current cell, time of its entry [-, s]
    output  ``clock``        3    lag since the cell was entered [s], pace [-], the pace's derivative
                                  [1/s]; (0, 1, 0) where the team was never held
    ======= ================ ==== ====================================================================

    State: one discrete group, updated at the start of every step, or every ``period``, in which ``hold``
    changes: the time of the change, ``hold`` from then on, and a, b and the lag at that time. All robots that
    hear the same bits have the same clock, to the last bit.

    Args:
        period: Time between updates [s], None for every step.
        offset: Time of the first update [s].
    """

    def __init__(self, period: float | None = None, offset: float = 0.0) -> None:
        super().__init__()
        self._nothing = EventStatus.DidNothing()
        self._hold = self.DeclareVectorInputPort("hold", 1)
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self.DeclareDiscreteState(np.zeros(5))
        entered = self.input_port_ticket(self._cell.get_index())
        tickets = {self.time_ticket(), self.xd_ticket(), entered}
        self.DeclareVectorOutputPort("clock", CLOCK_SIZE, self._write_clock, tickets)
        self.declare_update(self._follow, period, offset)

    def _follow(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        held, state = float(self._hold.Eval(context)[0]), self.kept(context)
        if held == state[1]:
            return self._nothing
        a, b, _, lag = self._now(context)
        discrete_state.get_mutable_vector().SetFromVector([context.get_time(), held, a, b, lag])
        return EventStatus.Succeeded()

    def _write_clock(self, context: Context, output: BasicVector) -> None:
        _, b, b_rate, lag = self._now(context)
        output.SetFromVector([lag, 1.0 - b, -b_rate])

    def _now(self, context: Context) -> tuple[float, float, float, float]:
        """Return a, b, b' and the lag since the current cell was entered."""
        state, entry = self.kept(context), float(self._cell.Eval(context)[1])
        a, b, b_rate, lag = lagging_clock(context.get_time() - state[0], state[1], state[2:])
        if entry > state[0]:  # the cell was entered since; what was lost before does not count
            lag -= lagging_clock(entry - state[0], state[1], state[2:])[3]
        return a, b, b_rate, lag
