"""What is demanded of the messages of one session: numbers that grow, and not too many."""

from __future__ import annotations

import math

from coop_drake.messages.refusals import Reason, RefusedError

RATE = 20_000.0
"""Messages that one sender may send in the long run [1/s]; a robot at 1 kHz sends four thousand."""

BURST = 2_000
"""Messages that it may send at once; after a stop of 0.5 s a robot at 1 kHz has two thousand to send."""


class Incoming:
    """Judges the messages of one session by their numbers and their rate.

    Args:
        rate: Largest rate in the long run [1/s], None for any.

    Attributes:
        last: Number of the last message that was taken, 0 before the first.
        received: How many were taken.
        lost: How many never came, or came too late.
    """

    def __init__(self, rate: float | None = RATE) -> None:
        self.last = self.received = self.lost = 0
        self._rate, self._allowance, self._judged = rate, float(BURST), -math.inf

    def limit(self, now: float) -> None:
        """Count a message against the rate, before it is read.

        Args:
            now: Time of a clock that never goes back [s].

        Raises:
            RefusedError: Its sender sends too much.
        """
        if self._rate is not None:
            gained = self._rate * (now - self._judged)
            self._allowance, self._judged = min(BURST, self._allowance + gained), now
            if self._allowance < 1.0:
                raise RefusedError(Reason.FLOOD)
            self._allowance -= 1.0

    def take(self, sequence: int) -> None:
        """Take a message that is well formed.

        Args:
            sequence: Its number.

        Raises:
            RefusedError: Its number has been passed.
        """
        if sequence <= self.last:
            raise RefusedError(Reason.SEQUENCE)
        self.lost += sequence - self.last - 1
        self.last, self.received = sequence, self.received + 1
