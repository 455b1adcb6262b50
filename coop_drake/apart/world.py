"""The world's exchange with all processes at every sample: in lock-step, or paced by the wall clock."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable, Sequence
from math import inf
from typing import Any

import numpy as np

from coop_drake.apart import REJOIN, messages
from coop_drake.apart.membership import TOLERATED, Membership, Processes
from coop_drake.apart.node import ASKS, FOLLOWS, MOVES, RETURNS, STATES, TURN, Stillness
from coop_drake.apart.transport import Ends, Network
from coop_drake.errors import MessagingError
from coop_drake.laws.actuators import Brake, braking_effort
from coop_drake.tree.arrays import FloatArray

PATIENCE = 5.0
"""How long a process may take for an answer in lock-step before the run goes on without it [s]."""

_ROUNDING = 1e-6
"""Differences of times that are no difference [s]."""

_REPORTED = 0.1
"""Simulated time between two reports of facts about the processes [s]: as often as people can read them."""

_REHEARSALS = 20
"""How often everybody is asked what it would log before the first sample by the wall clock [-]: the first
answers of a process take several times as long as the later ones."""


class Pacing:
    """Lets samples begin no earlier than by the wall clock, and collects ages.

    The world measures them by its own clock alone, from the question to the answer, so that clocks of other
    machines do not matter.

    Args:
        allowed: Largest age that is allowed [s].
    """

    def __init__(self, allowed: float) -> None:
        self.allowed, self._ages = allowed, list[float]()
        self._start: float | None = None
        self._slipped = 0.0

    def wait(self, time: float) -> None:
        """Wait until the wall clock has reached a simulated time [s]; a run that is late stays late."""
        now = clocks.monotonic()
        if self._start is None:
            self._start = now - time
        left = self._start + time - now
        if left > 0.0:
            clocks.sleep(left)
        else:
            self._start -= left
            self._slipped -= left

    def note(self, age: float) -> None:
        """Note the age of a command [s]."""
        self._ages.append(age)

    def facts(self) -> dict[str, float]:
        """Return what was measured [s]: ages of what commands were computed from, when they came back.

        ``high`` is that below which 99.9 % of them are, ``late`` how many of all ``count`` were older than
        ``allowed``, ``slipped`` by how much the run took longer than its simulated time.
        """
        ages = np.array(self._ages or [0.0])
        return {
            "count": len(self._ages),
            "median": float(np.median(ages)),
            "high": float(np.quantile(ages, 0.999)),
            "largest": float(ages.max()),
            "late": int((ages > self.allowed).sum()),
            "allowed": self.allowed,
            "slipped": self._slipped,
        }


class SampleExchange:
    """Hands measurements over through sockets and waits for the answers.

    A message of the team counts from the instant after the sample in which it was sent. Since the team's
    channel is another one than that of the world, every answer says how many messages its sender has sent,
    and the next question says how many its receiver must have received.

    A process that is gone, or gives no answer for too long, is missing, see ``Membership``, until it answers
    again. In lock-step nobody who is missing is asked before the team rests. Then the simulated time waits.
    Who is there, but is not heard of because messages are lost, is asked on at every sample: the last message
    of an answer, which no fault touches, says that there is no other.

    The simulation first looks at an instant, for the log, and then takes the sample that is due there. Both
    are one question: everybody shows what it would log before its update, then updates.

    Args:
        ends: The world's sockets, with sessions.
        network: Robots, period of the samples, and faults of the robots' clocks.
        cells: Number of cells of the plan; a supervisor that names any other is refused.
        pacing: Keeps the pace of the wall clock; None for lock-step, in which every sample waits.
        tolerated: How long drives hold the last effort of a robot that gives no other [s].
        oldest: Largest age that measurements on which an effort rests may have at its sample [s]; drives do
            not take any other.
        processes: Knows which processes have ended, and may start them again.
        patience: How long a process may take for an answer in lock-step [s].
        rejoin: How long a team at rest waits for who is missing [s], by the wall clock.
        before: Called before every sample with its number.
        report: Called ten times in a simulated second with facts about the processes.
        tell: Is told what happens to processes.

    Attributes:
        sample: Number of the present sample.
        membership: Who is missing, and whether the drives brake.
        missing: Since which simulated time each missing process is missing [s].
        brakes: How the drives of each robot brake.
    """

    def __init__(
        self,
        ends: Ends,
        network: Network,
        cells: int,
        *,
        pacing: Pacing | None = None,
        tolerated: float = TOLERATED,
        oldest: float = inf,
        processes: Processes | None = None,
        patience: float = PATIENCE,
        rejoin: float = REJOIN,
        before: Callable[[int], None] = lambda sample: None,
        report: Callable[[dict[str, Any]], None] = lambda facts: None,
        tell: Callable[[str], None] = lambda words: None,
    ) -> None:
        self._ends, self._patience, self._before, self._pacing = ends, patience, before, pacing
        self._cells = cells
        self._everyone, self._period = [*range(len(network.book.robots)), messages.SUPERVISOR], network.period
        self.report, self._every = report, max(1, round(_REPORTED / network.period))
        self._clock, self._oldest = network.faults.clock, oldest + _ROUNDING
        self._passes = network.passes
        self.membership = Membership(
            tolerated=tolerated,
            rejoin=rejoin,
            processes=processes or Processes(),
            tell=tell,
        )
        self.missing, self.brakes = self.membership.missing, list[Brake]()
        self.sample, self._still = 0, Stillness(network.period)
        self._last: dict[tuple[int, type], Any] = {}
        self._states = dict[int, int]()
        self._counts, self._rests = dict[int, Any](), dict[int, FloatArray]()
        self._asked: dict[int, tuple[float, float]] = {}
        self._sizes: list[int] = []
        self._stamps: Sequence[FloatArray] = ()
        self._answered, self._ages = dict[int, float](), dict[int, float]()
        self._sampled, self._expected, self._unheard = -1, dict[int, tuple[int, float]](), set[int]()

    def trouble(self) -> str:
        """See ``Exchange``."""
        return self.membership.trouble

    def stopped(self) -> bool:
        """See ``Exchange``."""
        return self.membership.stopped or RETURNS in self._states.values()

    def facts(self) -> dict[str, Any]:
        """Return what a run reports about its processes: answers, messages of the team, ages of commands."""
        ages = {} if self._pacing is None else {"command_ages": self._pacing.facts()}
        refused = {why.name: n for why, n in self._ends.refusals.counts.items()}
        processes = [self._process_facts(index) for index in self._everyone]
        return {"processes": processes, "refused": refused, **self.membership.facts(), **ages}

    def _process_facts(self, index: int) -> dict[str, Any]:
        """Return what a run reports about one process."""
        shown = self._last.get(
            (index, messages.Status if index == messages.SUPERVISOR else messages.Telemetry)
        )
        state, since = STATES[self._states.get(index, FOLLOWS)], self.missing.get(index)
        there = "there" if index == messages.SUPERVISOR else state
        missing = "gone" if index in self.membership.gone() else "silent"
        return {
            "name": messages.name_of(index),
            "state": there if since is None else missing,
            "missing_since": since,
            "team_messages": 0 if shown is None else int(np.sum(shown.team_messages)),
            "refused": 0 if shown is None else shown.refused,
            "age": self._ages.get(index),
        }

    def step(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None = None
    ) -> list[FloatArray]:
        """See ``Exchange``."""
        if self._sampled != self.sample:
            self._take_sample(time, measured, stamps)
        self.sample += 1
        return [self._effort(k, own) for k, own in enumerate(measured)]

    def look(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None = None
    ) -> FloatArray:
        """See ``Exchange``."""
        if time == self.sample * self._period:
            self._take_sample(time, measured, stamps)
        elif not self.trouble():
            self._stamps = [np.full(2, time) for _ in measured] if stamps is None else stamps
            self._ask(time, measured, step=False)
        needed = {
            (messages.SUPERVISOR, messages.Status),
            *((k, messages.Telemetry) for k in self._everyone[:-1]),
        }
        if not needed <= self._last.keys():
            self.membership.give_up()
            raise MessagingError(self.trouble())
        status = self._last[messages.SUPERVISOR, messages.Status]
        shown = [self._last[k, messages.Telemetry].values for k in self._everyone[:-1]]
        cell = [] if self._passes else [status.cell, status.entry]
        return np.concatenate([*shown, [*cell, status.arrived, *status.causes]])

    def _take_sample(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None
    ) -> None:
        """Let everybody compute once, which shows before the update what it would log."""
        self._stamps = [np.full(2, time) for _ in measured] if stamps is None else stamps
        self._before(self.sample)
        if self.sample % self._every == 0:
            self.report(self.facts())
        if self._pacing is not None:
            for _ in range(0 if self.sample else _REHEARSALS):
                self._ask(time, measured, step=False)
            self._pacing.wait(time)
        self._sampled, membership = self.sample, self.membership
        rests = self._still.sees_rest(np.concatenate([own[(len(own) - 3) // 2 : -3] for own in measured]))
        membership.see(time, self._states, rests=rests)
        robots = self.missing.keys() - {messages.SUPERVISOR}
        away = self.missing.keys() - self._unheard
        if self._pacing is None and away and rests and (membership.stopped or not robots):
            self._await(time, measured)
        if not membership.trouble:
            self._ask(time, measured, step=True)
            self._close_line(time)

    def _close_line(self, time: float) -> None:
        """Let the drives go on where all robots have begun their cell at the present sample."""
        efforts = [self._last.get((k, messages.Effort)) for k in self._everyone[:-1]]
        begun = all(e and e.number == self.sample and e.state in MOVES for e in efforts)
        if self.membership.stopped and begun and not self.missing:
            self.membership.close_line(time, returns=RETURNS in self._states.values())

    def _effort(self, robot: int, measured: FloatArray) -> FloatArray:
        """Return what the drives of a robot do."""
        if self.membership.stopped or (known := self._last.get((robot, messages.Effort))) is None:
            return braking_effort(measured[:-3], self.brakes[robot], self._rests.get(robot))
        return np.array(known.efforts)

    def _await(self, time: float, measured: Sequence[FloatArray]) -> None:
        """Wait with the simulated time at rest until all are there and know the current cell, or time out."""
        while not self.membership.timed_out():
            if not self._ask(time, measured, step=False, waits_for_all=True):
                for index in self.missing.keys() - self._unheard:
                    self.membership.back(index)
                return
        self.membership.give_up()

    def _ask(
        self, time: float, measured: Sequence[FloatArray], *, step: bool, waits_for_all: bool = False
    ) -> set[int]:
        """Ask all who are there, and wait for their answers, which replace the last ones; return who is late.

        Where the pace is that of the wall clock, those who are missing are asked, too, and not waited for.
        """
        everyone = waits_for_all or self._pacing is not None
        away = self.missing.keys() - self._unheard
        asked = [index for index in self._everyone if everyone or index not in away]
        self._sizes = [(len(own) - 3) // 2 for own in measured]  # As many efforts as own coordinates.
        self._asked[self.sample] = clocks.monotonic(), time
        self._ends.sample = self.sample
        asking = {k: self._question(k, time, measured, step=step) for k in asked}
        self._expected = {k: (q.number, q.time) for k, q in asking.items() if self._ends.send(k, q)}
        for index, late_ones in self._ends.release().items():
            if late_ones:
                self._expected.setdefault(index, max((late.number, late.time) for late in late_ones))
        reached = self._expected.keys() | ({*asked} - self._ends.present())
        waiting = {
            (index, messages.Status if index == messages.SUPERVISOR else messages.Telemetry)
            for index in (asked if waits_for_all else reached - away)
        }
        deadline = clocks.monotonic() + (TURN if waits_for_all else self._limit())
        while waiting and (left := deadline - clocks.monotonic()) > 0.0:
            if (taken := self._ends.receive(min(TURN, left))) is not None:
                waiting.discard(self._keep(*taken, admits=everyone))
            elif not waits_for_all:
                gone = {index for index, _ in waiting if self._has_gone(index)}
                self._lose(gone)
                waiting = {(index, wanted) for index, wanted in waiting if index not in gone}
        late = {index for index, _ in waiting}
        if not waits_for_all and (step or not self._pacing):  # Between samples nothing moves by an answer.
            self._lose(self._quiet(late, time) if self._pacing else late - self.missing.keys())
            if step:
                self._unheard |= (quiet := self._quiet({*asked} - late, time))  # Who is there, but not heard.
                self._lose(quiet)
        return late

    def _question(
        self, index: int, time: float, measured: Sequence[FloatArray], *, step: bool
    ) -> messages.Sample | messages.Tick:
        """Return what a process is asked at an instant."""
        head = self.sample, self._clock(index, time), step, self.membership.stopped
        if index == messages.SUPERVISOR:
            return messages.Tick(*head, self._told(-1)[:-1])
        own, heard, (placed, moved) = measured[index], self._told(index), self._stamps[index].tolist()
        pose, state = tuple(own[-3:].tolist()), tuple(own[:-3].tolist())
        return messages.Sample(*head, heard, placed, moved, pose, state)

    def _told(self, index: int) -> tuple[int, ...]:
        """Return how many messages each robot, then the supervisor, have sent to the one of an index."""
        nothing = [0] * len(self._everyone)
        return tuple(self._counts.get(k, nothing)[index] for k in self._everyone)

    def _fits(self, sender: int, message: messages.Effort | messages.Telemetry | messages.Status) -> bool:
        """Whether the lists of an answer are as long as they must be, and its state and its cell exist."""
        robots = len(self._sizes)
        if isinstance(message, messages.Status):
            fitting = len(message.team_messages) == robots and len(message.causes) in (0, 1 + robots)
            return fitting and message.cell < self._cells
        if len(message.team_messages) != robots + 1:
            return False
        if isinstance(message, messages.Effort):
            size = self._sizes[sender]
            fitting = len(message.efforts) == size and len(message.rest) in (0, size)
        else:
            before = self._last.get((sender, messages.Telemetry))
            fitting = before is None or len(before.values) == len(message.values)
        return fitting and message.state < len(STATES)

    def _quiet(self, indices: set[int], time: float) -> set[int]:
        """Return those that are not missing yet, and whose last efforts were held for too long."""
        late = self.membership.too_long
        return {k for k in indices - self.missing.keys() if late(self._since(k, time), time)}

    def _limit(self) -> float:
        """How long answers are waited for [s]: long before anything moves, longer while the drives brake."""
        if self._pacing is None or self.sample == 0:
            return self._patience
        return max(self._pacing.allowed, TOLERATED if self.membership.stopped else 0.0)

    def _since(self, index: int, time: float) -> float:
        return self._answered.get(index, time if self._pacing else 0.0)

    def _has_gone(self, index: int) -> bool:
        """Whether a process has ended, or its connection is closed, which a sign of life shows."""
        return index in self.membership.gone() or not self._ends.send(index, messages.Welcome())

    def _lose(self, indices: Any) -> None:
        """Go on without processes; what they have sent to the team need not be waited for."""
        lost = set(indices)
        for index in lost:
            self._counts.pop(index, None)
        self.membership.lose({index: self._since(index, 0.0) for index in lost})

    def _keep(self, sender: int, message: Any, *, admits: bool) -> tuple[int, type]:
        """Keep an answer that is newer than the last; return who answered the present question, and how.

        Args:
            sender: Who answers.
            message: The answer.
            admits: Whether one who is missing may come back.
        """
        kind, nothing = type(message), (sender, type(None))
        was_missing, unheard = sender in self.missing, sender in self._unheard
        if not isinstance(message, messages.Effort | messages.Telemetry | messages.Status) or (
            was_missing and not (admits or unheard)
        ):
            return nothing
        if message.number > self.sample or not self._fits(sender, message):
            self._ends.refusals.add(messages.RefusedError(messages.Reason.VALUE))
            return nothing
        asked, time = self._asked[message.number]
        if (
            isinstance(message, messages.Effort)
            and not time - self._oldest <= message.stamp <= time + _ROUNDING
        ):
            self._ends.refusals.add(messages.RefusedError(messages.Reason.STAMP))
            return nothing
        expected = self._expected.get(sender, (self.sample, -inf))
        present = (message.number, getattr(message, "time", inf)) >= expected
        age = clocks.monotonic() - asked
        if isinstance(message, messages.Effort) and self._pacing is not None:
            self._pacing.note(age)
        if was_missing and not present and not (self._pacing and age <= self._pacing.allowed):
            return nothing
        self._counts[sender] = message.team_messages
        if not isinstance(message, messages.Status):
            self._states[sender] = message.state
        knows = message.knows if isinstance(message, messages.Status) else message.state != ASKS
        known = self._last.get((sender, kind))
        if not knows:
            return nothing
        if known is None or message.number >= known.number:
            self._last[sender, kind] = message
            if kind is not messages.Telemetry:
                self._answered[sender], self._ages[sender] = time, age
            if isinstance(message, messages.Effort) and message.rest:
                self._rests[sender] = np.array(message.rest)
        if was_missing and kind is not messages.Telemetry and (self._pacing is not None or unheard):
            self._unheard.discard(sender)
            self.membership.back(sender)
        return (sender, kind) if present else nothing
