"""The exchange over sockets: in lock-step, or paced by the wall clock."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from coop_drake.errors import MessagingError
from coop_drake.laws.braking import braking_effort
from coop_drake.messages import (
    SUPERVISOR,
    Effort,
    Present,
    Reason,
    Sample,
    Status,
    Telemetry,
    Tick,
    WorldEnd,
    name_of,
)
from coop_drake.nodes.pacing import Pacing
from coop_drake.nodes.serving import TURN
from coop_drake.tree.pose import FloatArray

PATIENCE = 5.0
"""How long a process may take for an answer in lock-step before the run goes on without it [s]."""

TOLERATED = 0.02
"""How long drives hold the last effort of a robot that gives no other [s]: shipped transports lose nothing
by it."""


STATES = ("follows the plan", "holds")
"""States of a robot in words, see ``messages.Effort``."""


class SampleExchange:
    """Hands measurements over through sockets and waits for the answers.

    A message of the team counts from the instant after the sample in which it was sent. Since the team's
    channel is another one than that of the world, every answer says how many messages its sender has sent,
    and the next question says how many its receiver must have received.

    The simulation first looks at an instant, for the log, and then takes the sample that is due there. Both
    are one question: everybody shows what it would log before its update, then updates.

    A process that is gone, or gives no answer for too long, is missing for the rest of the run. The drives of
    a robot without answers hold its last effort for ``TOLERATED``. Then they open the line of the emergency
    stop, which is common to all drives, and all robots brake.

    Args:
        end: The world's sockets, with sessions.
        robots: Number of robots N.
        period: Control period [s].
        pacing: Keeps the pace of the wall clock; None for lock-step, in which every sample waits.
        gone: Returns the processes that are known to have ended.
        patience: How long a process may take for an answer in lock-step [s].
        before: Called before every sample with its number.

    Attributes:
        sample: Number of the present sample.
        missing: Since which simulated time each missing process is missing [s].
    """

    def __init__(
        self,
        end: WorldEnd,
        robots: int,
        period: float,
        *,
        pacing: Pacing | None = None,
        gone: Callable[[], Collection[int]] = tuple,
        patience: float = PATIENCE,
        before: Callable[[int], None] = lambda sample: None,
    ) -> None:
        self._end, self._gone, self._patience, self._before = end, gone, patience, before
        self._pacing, self._period = pacing, period
        self._everyone = [*range(robots), SUPERVISOR]
        self.sample, self.missing = 0, dict[int, float]()
        self._last: dict[tuple[int, type], Any] = {}
        self._asked: dict[int, float] = {}
        self._sizes: list[int] = []
        self._answered: dict[int, float] = {}
        self._sampled = -1

    def trouble(self) -> str:
        """Return who is missing since when; empty where everybody is there."""
        said = (f"{name_of(k)} has not answered since t = {t:.6g} s" for k, t in sorted(self.missing.items()))
        return "; ".join(said)

    def facts(self) -> dict[str, Any]:
        """Return what a run reports about its processes: answers, messages of the team, ages of commands."""
        processes = []
        for index in self._everyone:
            effort = self._last.get((index, Effort))
            said = self._last.get((index, Status if index == SUPERVISOR else Effort))
            counts = () if said is None else np.atleast_1d(said.team_messages)
            state = "missing" if index in self.missing else "" if effort is None else STATES[effort.state]
            processes.append(
                {
                    "name": name_of(index),
                    "state": state or "there",
                    "missing_since": self.missing.get(index),
                    "team_messages": int(sum(counts)),
                }
            )
        ages = {} if self._pacing is None else {"command_ages": asdict(self._pacing.ages())}
        refused = self._end.refusals.counts
        return {"processes": processes, "refused": {why.name: n for why, n in refused.items()}, **ages}

    def step(self, time: float, measured: Sequence[FloatArray]) -> list[FloatArray]:
        """See ``Exchange``."""
        if self._sampled != self.sample:
            self._take_sample(time, measured)
        self.sample += 1
        return [self._effort(k, time, own) for k, own in enumerate(measured)]

    def look(self, time: float, measured: Sequence[FloatArray]) -> FloatArray:
        """See ``Exchange``."""
        if time == self.sample * self._period:
            self._take_sample(time, measured)
        else:
            self._ask(time, measured, step=False)
        needed = {(SUPERVISOR, Status), *((k, Telemetry) for k in self._everyone[:-1])}
        if not needed <= self._last.keys():
            raise MessagingError(self.trouble())
        status = self._last[SUPERVISOR, Status]
        shown = [self._last[k, Telemetry].values for k in self._everyone[:-1]]
        return np.concatenate([*shown, [status.cell, status.entry, status.arrived, *status.causes]])

    def _take_sample(self, time: float, measured: Sequence[FloatArray]) -> None:
        """Let everybody compute once, which shows before the update what it would log."""
        self._before(self.sample)
        if self._pacing is not None:
            self._pacing.wait(time)
        self._ask(time, measured, step=True)
        self._sampled = self.sample

    def _effort(self, robot: int, time: float, measured: FloatArray) -> FloatArray:
        """Return what the drives of a robot do."""
        stopped = any(time - since > TOLERATED for k, since in self.missing.items() if k != SUPERVISOR)
        known = self._last.get((robot, Effort))
        return braking_effort(measured[:-3]) if stopped or known is None else np.array(known.efforts)

    def _ask(self, time: float, measured: Sequence[FloatArray], *, step: bool) -> None:
        """Ask all who are there, and wait for their answers, which replace the last ones."""
        asked = [index for index in self._everyone if index not in self.missing]
        self._sizes = [(len(own) - 3) // 2 for own in measured]  # As many efforts as own coordinates.
        self._asked[self.sample] = clocks.monotonic()
        for index in asked:
            self._end.send(index, self._question(index, time, measured, step=step))
        kind = Effort if step else Telemetry
        waiting = {(index, Status if index == SUPERVISOR else kind) for index in asked}
        limit = self._patience if self._pacing is None else self._pacing.allowed
        deadline = clocks.monotonic() + limit
        while waiting and (left := deadline - clocks.monotonic()) > 0.0:
            if (taken := self._end.receive(min(TURN, left))) is not None:
                waiting.discard(self._keep(time, *taken))
                continue
            gone = {index for index, _ in waiting if self._has_gone(index)}
            self._lose(gone)
            waiting = {(index, wanted) for index, wanted in waiting if index not in gone}
        late = {index for index, _ in waiting}
        bound = TOLERATED if self._pacing else -1.0
        self._lose({index for index in late if time - self._answered.get(index, time) > bound})

    def _has_gone(self, index: int) -> bool:
        """Whether a process has ended, or its connection is closed, which a sign of life shows."""
        return index in self._gone() or not self._end.send(index, Present())

    def _lose(self, indices: Collection[int]) -> None:
        """Go on without processes from the last instant that they have answered."""
        self.missing |= {index: self._answered.get(index, 0.0) for index in indices}

    def _question(self, index: int, time: float, measured: Sequence[FloatArray], *, step: bool) -> Any:
        if index == SUPERVISOR:
            return Tick(self.sample, time, step, tuple(self._sent(k) for k in self._everyone[:-1]))
        status, own = self._last.get((SUPERVISOR, Status)), measured[index]
        told = 0 if status is None else status.team_messages[index]
        return Sample(self.sample, time, step, told, tuple(own[-3:]), tuple(own[:-3]))

    def _fits(self, sender: int, message: Any) -> bool:
        """Whether an answer is about a sample that has been, and its lists are as long as they must be."""
        robots = len(self._everyone) - 1
        if isinstance(message, Effort):
            fits = len(message.efforts) == self._sizes[sender] and message.state < len(STATES)
        elif isinstance(message, Status):
            fits = len(message.team_messages) == robots and len(message.causes) in (0, 1 + robots)
        else:
            known = self._last.get((sender, Telemetry))
            fits = known is None or len(known.values) == len(message.values)
        return fits and message.number <= self.sample

    def _sent(self, robot: int) -> int:
        known = self._last.get((robot, Effort))
        return 0 if known is None else known.team_messages

    def _keep(self, time: float, sender: int, message: Any) -> tuple[int, type]:
        """Keep an answer that is newer than the last; return who answered the present question, and how."""
        kind = type(message)
        if not isinstance(message, Effort | Telemetry | Status) or sender in self.missing:
            return sender, type(None)
        if not self._fits(sender, message):
            self._end.efforts.refusals.add(Reason.VALUE)
            return sender, type(None)
        known = self._last.get((sender, kind))
        if known is None or message.number >= known.number:
            self._last[sender, kind] = message
            self._answered[sender] = time
        if isinstance(message, Effort) and self._pacing is not None:
            self._pacing.note(clocks.monotonic() - self._asked[message.number])
        return sender, kind if message.number == self.sample else type(None)
