"""What a robot's process and the supervisor's have in common: states, Diagrams at samples, and answers."""

from __future__ import annotations

import gc
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from pydrake.systems.framework import Diagram

from coop_drake.apart.messages import WORLD, Goodbye, Hello, Reason, RefusedError, Sample, Tick, Welcome
from coop_drake.apart.transport import Ends
from coop_drake.errors import MessagingError
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.readiness import MEAN_TIME, RATE_TOLERANCE
from coop_drake.systems.block import release_all
from coop_drake.tree.arrays import FloatArray

FOLLOWS, HOLDS, STANDS, ASKS, OUTSIDE, RETURNS, LATE = range(7)
"""States of a robot, see ``messages.Effort``."""

STATES = (
    "follows the plan",
    "holds",
    "waits at rest to begin its cell anew",
    "does not know the current cell",
    "rests where it cannot begin its cell anew",
    "returns slowly to its cell",
    "has measurements that are older than the plan allows, or stamps that cannot be",
)
"""The same in words."""

MOVES = (FOLLOWS, HOLDS, RETURNS)
"""States in which a robot gives efforts of its own."""

AGAIN = 0.1
"""Time after which a message that has had no effect yet is sent again [s]: long for a message and its answer,
short beside the time in which a team comes to rest."""

REPORT_TIMEOUT = 0.025
"""Time after which a robot retransmits a report to which no new cell has come [s]: robots of the shipped
``base`` become ready to leave a cell within 20 ms, in one cell within 35 ms, so that a channel without losses
carries each report once. The funnels of shipped transports bear this delay of one robot."""

LOSSY_REPORT_TIMEOUT = 0.01
"""The same once a new cell has come late, because its message or a report was lost [s]."""

LOSSY_COPIES = 3
"""In so many further samples the supervisor sends a new cell, after a robot has missed one [-]: with
a fifth of all messages lost, a robot then misses all of them less than twice in a thousand cells."""

LASTING = 0.3
"""For how long a robot sees rest before it says so [s]: braked teams swing with periods above a second."""

AHEAD = 0.1
"""Time between the order to begin and the sample at which all robots begin [s]: every robot must have heard
it by then. While one has not, the drives brake on, and the order is given again."""

TURN = 0.2
"""How often a process without news sees whether it is still wanted [s]."""

_SILENCE = 30.0
"""Longest time without a message before a process ends [s]."""

MOST_WAITING = 4096
"""Messages of one sender that wait at most for the samples for which they count: a few come in each."""


class SampledDiagram:
    """A Diagram without continuous state, whose inputs and time are set by hand.

    Drake's Simulator does the same at an instant: it computes all discrete updates from the state before,
    and then puts them into effect together.

    Args:
        diagram: All its discrete updates have one period and no offset.
        decides: Whether blocks in it decide before all others update, by unrestricted updates.
    """

    def __init__(self, diagram: Diagram, *, decides: bool = False) -> None:
        self.diagram, self.context = diagram, diagram.CreateDefaultContext()
        self._decided = diagram.CreateDefaultContext() if decides else None
        self._inputs: dict[str, FloatArray] = {}

    def at(self, time: float, inputs: Mapping[str, FloatArray]) -> None:
        """Set the time [s] and the inputs; what was computed for the same ones is not computed again."""
        if time != self.context.get_time():
            self.context.SetTime(time)
        for name, value in inputs.items():
            known = self._inputs.get(name)
            if known is None or known.tobytes() != value.tobytes():
                self.diagram.GetInputPort(name).FixValue(self.context, value)
                self._inputs[name] = value.copy()

    def update(self) -> None:
        """Carry out the updates of one sample."""
        if self._decided is not None:
            self._decided.SetDiscreteState(self.context.get_discrete_state())
            self.diagram.CalcForcedUnrestrictedUpdate(self.context, self._decided.get_mutable_state())
            self.context.SetDiscreteState(self._decided.get_discrete_state())
        if self.diagram.GetUniquePeriodicDiscreteUpdateAttribute() is None:
            return
        self.context.SetDiscreteState(self.diagram.EvalUniquePeriodicDiscreteUpdate(self.context))

    def output(self, name: str) -> FloatArray:
        """Return the present value of an output."""
        return np.array(self.diagram.GetOutputPort(name).Eval(self.context))

    def release(self) -> None:
        """Free all memory; the Diagram may not be used any more."""
        del self.context, self._decided
        release_all(self.diagram)


def row_of(diagram: SampledDiagram, inner: Diagram, names: Sequence[str]) -> FloatArray:
    """Return the present values of outputs of a Diagram inside a sampled one, one after the other."""
    context = inner.GetMyContextFromRoot(diagram.context)
    return np.concatenate([inner.GetOutputPort(name).Eval(context) for name in names])


class Stillness:
    """Keeps the last samples over ``MEAN_TIME``.

    Args:
        period: Time between two samples [s].
        lasting: For how long rest must have been seen without a break [s]; what swings rests at its turning
            points, too.
    """

    def __init__(self, period: float, lasting: float = 0.0) -> None:
        self._needed, self._rested = whole_periods(lasting, period), 0
        self._samples: deque[FloatArray] = deque(maxlen=whole_periods(MEAN_TIME, period))
        self._seen: deque[FloatArray] = deque(maxlen=self._samples.maxlen)

    def restart(self) -> None:
        """Forget all samples."""
        self._rested = 0
        self._samples.clear()
        self._seen.clear()

    @property
    def full(self) -> bool:
        """Whether samples over the whole window have been seen."""
        return len(self._samples) == self._samples.maxlen

    def sees_rest(self, rates: FloatArray, seen: FloatArray | None = None) -> bool:
        """Take in a sample; return whether the mean of no rate exceeds ``RATE_TOLERANCE`` over the window.

        Args:
            rates: All rates that count [m/s or rad/s].
            seen: What :meth:`mean` averages.
        """
        self._samples.append(np.array(rates))
        if seen is not None:
            self._seen.append(np.array(seen))
        rests = self.full and bool(np.abs(np.mean(self._samples, axis=0)).max() <= RATE_TOLERANCE)
        self._rested = self._rested + 1 if rests else 0
        return self._rested > self._needed

    def mean(self) -> FloatArray:
        """Return the mean of what was seen over the window."""
        mean: FloatArray = np.mean(self._seen, axis=0)
        return mean


class Mail:
    """Messages of one sender of the team in one session, handed on in their order."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Begin a session; what is left of the one before is gone."""
        self._waiting: deque[Any] = deque()
        self._used = 0

    def add(self, message: Any) -> bool:
        """Add a message; return whether there was room for it."""
        room = len(self._waiting) < MOST_WAITING
        if room:
            self._waiting.append(message)
        return room

    def has(self, count: int) -> bool:
        """Whether so many messages of the session have come."""
        return self._used + len(self._waiting) >= count

    def take(self, count: int) -> list[Any]:
        """Return those of the first ``count`` messages of the session that are new."""
        number = max(count - self._used, 0)
        self._used += number
        return [self._waiting.popleft() for _ in range(number)]


class NodeProcess(ABC):
    """A robot or the supervisor as a process: answers the world until it says goodbye.

    A message of the team counts from the instant after the sample in which it was sent, also where it comes
    earlier: an answer uses as many messages as its question says.

    Args:
        ends: The sockets, with sessions.
        team: Indices of those whose messages are heard.
    """

    def __init__(self, ends: Ends, team: Iterable[int]) -> None:
        self._ends, self._mail = ends, {index: Mail() for index in team}
        self._question: Any = None
        self._begun = False

    def run(self, wanted: Callable[[], bool]) -> int:
        """Answer until the world says goodbye; return the outcome that it names.

        Args:
            wanted: Says whether the process shall go on; asked while nothing comes.

        Raises:
            MessagingError: The world was silent for too long, or the process is not wanted any more.
        """
        gc.freeze()  # To collect garbage among all that was imported takes a tenth of a second.
        waited = 0.0
        while True:
            taken = self._ends.receive(TURN)
            waited = 0.0 if taken is not None else waited + TURN
            if taken is None and (waited > _SILENCE or not wanted()):
                raise MessagingError(f"the world has said nothing for {waited:.1f} s")
            # Everything that is there first, but of a flood a part: it may count for the next answer.
            arrived = 0
            while taken is not None:
                sender, message = taken
                if isinstance(message, Goodbye):
                    return message.outcome
                if isinstance(message, Sample | Tick):
                    self._ask(message)
                elif sender != WORLD:
                    self._receive(sender, message)
                arrived += 1
                taken = self._ends.receive() if arrived < MOST_WAITING else None
            if self._question is not None and self._answered(self._question):
                self._question = None

    def _ask(self, question: Sample | Tick) -> None:
        """Take in a question, which replaces one for whose answer the world does not wait any more."""
        if words := self._objection(question):
            self._ends.refusals.add(RefusedError(Reason.VALUE, f"{words}, in {type(question).__name__}"))
            return
        if not self._begun:
            self._begun = True
            self._begin(question)
        self._question = question

    def _receive(self, sender: int, message: Any) -> None:
        if isinstance(message, Hello | Welcome):
            self._mail[sender].restart()
        elif not self._mail[sender].add(message):
            self._ends.refusals.add(RefusedError(Reason.FLOOD))

    def _answered(self, question: Any) -> bool:
        """Answer a question, unless messages that count for it have not come yet."""
        counts = self._counts(question)
        if not all(self._mail[index].has(count) for index, count in counts.items()):
            return False
        for index, count in counts.items():
            for message in self._mail[index].take(count):
                self._hear(index, message)
        self._answer(question)
        return True

    @abstractmethod
    def _objection(self, question: Any) -> str:
        """Say why a question does not fit this process; nothing where it does."""

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
