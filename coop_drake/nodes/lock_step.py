"""The exchange over sockets in which nobody is quicker than another: every sample waits for all answers."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from coop_drake.errors import MessagingError
from coop_drake.messages import SUPERVISOR, Effort, Sample, Status, Telemetry, Tick, WorldEnd, name_of
from coop_drake.nodes.serving import TURN
from coop_drake.tree.pose import FloatArray


class LockStep:
    """Hands measurements over through sockets and waits for the answers.

    A message of the team counts from the instant after the sample in which it was sent. Since the team's
    channel is another one than that of the world, every answer says how many messages its sender has sent,
    and the next question says how many its receiver must have received.

    Args:
        end: The world's sockets, with sessions.
        robots: Number of robots N.
        check: Called while the exchange waits; raises where a process is known to have ended.
        patience: How long a process may take for an answer [s].

    Attributes:
        sample: Number of the present sample.
    """

    def __init__(
        self,
        end: WorldEnd,
        robots: int,
        *,
        check: Callable[[], None] = lambda: None,
        patience: float = 30.0,
    ) -> None:
        self._end, self._check, self._patience = end, check, patience
        self._robots = robots
        self.sample = 0
        self._sent = [0] * self._robots
        self._told = [0] * self._robots

    def step(self, time: float, measured: Sequence[FloatArray]) -> list[FloatArray]:
        """See ``Exchange``."""
        answers = self._ask(time, measured, step=True)
        self._sent = [answers[k].team_messages for k in range(self._robots)]
        self._told = [*answers[SUPERVISOR].team_messages]
        self.sample += 1
        return [np.array(answers[k].efforts) for k in range(self._robots)]

    def look(self, time: float, measured: Sequence[FloatArray]) -> FloatArray:
        """See ``Exchange``."""
        answers = self._ask(time, measured, step=False)
        status = answers[SUPERVISOR]
        supervision = [status.cell, status.entry, status.arrived, *status.causes]
        return np.concatenate([*(answers[k].values for k in range(self._robots)), supervision])

    def _ask(self, time: float, measured: Sequence[FloatArray], *, step: bool) -> dict[int, Any]:
        for k, own in enumerate(measured):
            pose, state = tuple(own[-3:]), tuple(own[:-3])
            self._end.send(k, Sample(self.sample, time, step, self._told[k], pose, state))
        self._end.send(SUPERVISOR, Tick(self.sample, time, step, tuple(self._sent)))
        kinds: dict[int, Any] = dict.fromkeys(range(self._robots), Effort if step else Telemetry)
        return self._answers(kinds | {SUPERVISOR: Status}, time)

    def _answers(self, kinds: dict[int, Any], time: float) -> dict[int, Any]:
        """Wait for one answer of everybody about an instant."""
        found: dict[int, Any] = {}
        deadline = clocks.monotonic() + self._patience
        while len(found) < len(kinds):
            taken = self._end.receive(TURN)
            if taken is not None:
                sender, message = taken
                if isinstance(message, kinds[sender]) and message.number == self.sample:
                    found[sender] = message
                continue
            self._check()
            if clocks.monotonic() > deadline:
                missing = ", ".join(name_of(index) for index in kinds if index not in found)
                raise MessagingError(f"{missing}: no answer within {self._patience:g} s at t = {time:g} s")
        return found
