"""Counts of messages that were refused, by reason."""

from __future__ import annotations

from collections import Counter
from enum import Enum


class Reason(Enum):
    """Why a message was refused."""

    PARTS = "more than one part"
    LENGTH = "its length fits no message of its kind"
    MAGIC = "it does not begin as messages do"
    VERSION = "another version of the schema"
    KIND = "a kind that is unknown, or that its sender may not send here"
    SENDER = "an unknown sender, or not the one whose key it is"
    SESSION = "no session, or one that is over"
    SEQUENCE = "its number has been passed: repeated or reordered"
    VALUE = "a value that its field does not allow"
    STAMP = "an effort that rests on older measurements than drives may use, or on ones of the future"
    FLOOD = "its sender sends too much"
    HANDSHAKE = "a connection that does not speak as it must, or has no allowed key"


class RefusedError(ValueError):
    """A message is refused; never leaves the receiving end.

    Args:
        reason: Why.
    """

    def __init__(self, reason: Reason) -> None:
        self.reason = reason
        super().__init__(reason.value)


class Refusals:
    """Counts refused messages.

    Attributes:
        counts: Number of messages by reason.
    """

    def __init__(self) -> None:
        self.counts: Counter[Reason] = Counter()

    def add(self, reason: Reason) -> None:
        """Count one."""
        self.counts[reason] += 1

    @property
    def total(self) -> int:
        """Number of all refused messages."""
        return self.counts.total()

    def __str__(self) -> str:
        return ", ".join(f"{count} ({reason.value})" for reason, count in self.counts.most_common()) or "none"
