"""What a robot's process and the supervisor's have in common: they answer the world, and hear their team."""

from __future__ import annotations

import gc
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from coop_drake.errors import MessagingError
from coop_drake.messages import WORLD, Goodbye, Present, RobotEnd, Sample, SupervisorEnd, Tick

TURN = 0.2
"""How often a process without news sees whether it is still wanted [s]."""


class Mail:
    """Messages of one sender of the team in one session, handed on in their order."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Begin a session; what is left of the one before is gone."""
        self._waiting: deque[Any] = deque()
        self._used = 0

    def add(self, message: Any) -> None:
        """Add a message."""
        self._waiting.append(message)

    def has(self, count: int) -> bool:
        """Whether so many messages of the session have come."""
        return self._used + len(self._waiting) >= count

    def take(self, count: int | None) -> list[Any]:
        """Return those of the first ``count`` messages of the session that are new; None for all new ones."""
        number = len(self._waiting) if count is None else max(count - self._used, 0)
        self._used += number
        return [self._waiting.popleft() for _ in range(number)]


class Server(ABC):
    """Answers the world until it says goodbye.

    In lock-step a message of the team counts from the instant after the sample in which it was sent, also
    where it comes earlier: an answer uses as many messages as its question says. Otherwise everything counts
    that has come.

    Args:
        end: The sockets, with sessions.
        team: Indices of those whose messages are heard.
        lock_step: Whether questions say how many messages count.
    """

    def __init__(self, end: RobotEnd | SupervisorEnd, team: Iterable[int], *, lock_step: bool) -> None:
        self._sockets, self._lock_step = end, lock_step
        self._mail = {index: Mail() for index in team}
        self._questions, self._begun = deque[Any](), False

    def run(self, wanted: Callable[[], bool], silence: float = 30.0) -> int:
        """Answer until the world says goodbye; return the outcome that it names.

        Args:
            wanted: Says whether the process shall go on; asked while nothing comes.
            silence: Longest time without a message of the world [s].

        Raises:
            MessagingError: The world was silent for too long, or the process is not wanted any more.
        """
        gc.freeze()  # To collect garbage among all that was imported takes a tenth of a second.
        waited = 0.0
        while True:
            taken = self._sockets.receive(TURN)
            waited = 0.0 if taken is not None else waited + TURN
            if taken is None and (waited > silence or not wanted()):
                raise MessagingError(f"the world has said nothing for {waited:.1f} s")
            # Everything that is there first: it may count for the next answer.
            while taken is not None:
                sender, message = taken
                if isinstance(message, Goodbye):
                    return message.outcome
                if isinstance(message, Sample | Tick):
                    self._queue(message)
                elif sender != WORLD:
                    self._receive(sender, message)
                taken = self._sockets.receive()
            while self._questions and self._answered(self._questions[0]):
                self._questions.popleft()

    def _queue(self, question: Sample | Tick) -> None:
        """Add a question.

        In lock-step it replaces those that the world does not wait for any more. Otherwise all steps that are
        late are made up for, but for those before the drives brake.
        """
        if not self._begun:
            self._begun = True
            self._begin(question)
        replaced = self._lock_step or question.stopped
        kept = () if replaced else (asked for asked in self._questions if asked.step)
        self._questions = deque((*kept, question))

    def _receive(self, sender: int, message: Any) -> None:
        if isinstance(message, Present):
            self._mail[sender].restart()
        self._mail[sender].add(message)

    def _answered(self, question: Any) -> bool:
        """Answer a question, unless messages that count for it have not come yet."""
        counts = self._counts(question) if self._lock_step else {}
        if not all(self._mail[index].has(count) for index, count in counts.items()):
            return False
        for index, mail in self._mail.items():
            for message in mail.take(counts.get(index)):
                self._hear(index, message)
        self._answer(question)
        return True

    @abstractmethod
    def _begin(self, question: Any) -> None:
        """See the first question; where it is not about sample 0, the process was started again."""

    @abstractmethod
    def _counts(self, question: Any) -> Mapping[int, int]:
        """Return how many messages of each member of the team count for a question of the world."""

    @abstractmethod
    def _hear(self, sender: int, message: Any) -> None:
        """Take in a message of the team."""

    @abstractmethod
    def _answer(self, question: Any) -> None:
        """Compute, speak to the team, then answer the world."""
