"""The messages of one session in one direction: their numbers, and what a faulty link does to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from coop_drake.laws.sampling import whole_periods
from coop_drake.messages.codec import encode
from coop_drake.messages.faults import NO_FAULTS, ChannelFaults, Faults, Gap
from coop_drake.messages.schema import SUPERVISOR, Status, Telemetry
from coop_drake.messages.wire import KINDS, Channel

_CHANNELS: tuple[Channel, ...] = ("sensors", "efforts", "team")

_ONLY_LOGGED = (Telemetry, Status)
"""Messages that a team without a log would not send."""


class Link:
    """Decides by seed and number of a message whether it is lost, repeated or late.

    Messages that open or close sessions, those that only the log needs, and those of the first sample pass: a
    robot that does not hear of the first sample is one that was started later.

    Args:
        channel: The channel.
        faults: What goes wrong.
        period: Control period [s].
        sender: Index of the sender.
        receiver: Index of the receiver.
    """

    def __init__(self, channel: Channel, faults: Faults, period: float, sender: int, receiver: int) -> None:
        self._faults: ChannelFaults = getattr(faults, channel)
        self._words = [faults.seed, _CHANNELS.index(channel), sender, receiver]
        self._robot = sender if sender < SUPERVISOR else receiver
        self._period, self._count = period, 0
        self.late_by = max(1, whole_periods(self._faults.late_by, period))

    def fate(self, message: Any, sample: int) -> tuple[int, bool]:
        """Return how often a message is sent, and whether it is sent late.

        Args:
            message: The message.
            sample: Number of the present sample.
        """
        f = self._faults
        opens = KINDS[type(message)].channel == "any" or sample == 0
        if opens or isinstance(message, _ONLY_LOGGED) or not getattr(message, "step", True):
            return 1, False
        self._count += 1
        if any(self._covers(gap, sample) for gap in f.gaps):
            return 0, False
        lost, repeated, late = np.random.default_rng([*self._words, self._count]).random(3)
        return (0 if lost < f.loss else 1 + int(repeated < f.repeat)), bool(late < f.late)

    def _covers(self, gap: Gap, sample: int) -> bool:
        first, last = (round(t / self._period) for t in (gap.begin, gap.begin + gap.duration))
        return first <= sample < last and (not gap.robots or self._robot in gap.robots)


@dataclass(frozen=True)
class Links:
    """Links between the processes of a team.

    Attributes:
        faults: What goes wrong.
        period: Control period [s].
    """

    faults: Faults = NO_FAULTS
    period: float = 1.0

    def between(self, channel: Channel, sender: int, receiver: int) -> Link | None:
        """Return what goes wrong with messages of a channel, None for nothing."""
        if getattr(self.faults, channel, ChannelFaults()) == ChannelFaults():
            return None
        return Link(channel, self.faults, self.period, sender, receiver)


SOUND = Links()
"""Where nothing goes wrong."""


class Outgoing:
    """Numbers the messages of one session in one direction, and sends them as the link lets it.

    Args:
        link: What goes wrong; None for nothing.

    Attributes:
        sent: Messages that the receiver takes: neither lost, nor so late that they are refused.
        sample: Number of the present sample.
    """

    def __init__(self, link: Link | None = None) -> None:
        self.sent = self.sample = self._numbered = self._newest = 0
        self._link = link
        self._kept: list[tuple[int, int, Any, bytes]] = []

    def restart(self, number: int = 0) -> None:
        """Begin a session, as if so many messages had been sent in it; what is late never leaves."""
        self.sent = self._numbered = self._newest = number
        self._kept.clear()

    def send(self, message: Any, sender: int, session: int, put: Callable[[bytes], bool]) -> bool:
        """Send a message; False where it is not sent now.

        Args:
            message: The message.
            sender: Who sends it.
            session: The session.
            put: Hands bytes to the socket; False where it does not take them.
        """
        number = self._numbered + 1
        data = encode(message, sender, session, number)
        copies, late = (1, False) if self._link is None else self._link.fate(message, self.sample)
        if late and copies and self._link is not None:
            self._kept.append((self.sample + self._link.late_by, number, message, data))
            copies = 0
        elif copies and not put(data):
            return False
        self._numbered = number
        for _ in range(copies - 1):
            put(data)
        return bool(copies) and self._passed(number)

    def release(self, put: Callable[[bytes], bool]) -> list[Any]:
        """Send what is late and due at the present sample; return the messages that the receiver takes."""
        due = [kept for kept in self._kept if kept[0] <= self.sample]
        self._kept = [kept for kept in self._kept if kept[0] > self.sample]
        return [message for _, number, message, data in due if put(data) and self._passed(number)]

    def _passed(self, number: int) -> bool:
        """Count a message that has left; False where a newer one has, so that it will be refused."""
        newer = number > self._newest
        self.sent += newer
        self._newest = max(number, self._newest)
        return newer
