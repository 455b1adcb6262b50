"""How the fields of a message stand in its bytes, and which messages exist."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

Channel = Literal["any", "sensors", "efforts", "team"]
"""Where a message belongs; ``any`` for those that open a session, which every channel has."""

Role = Literal["world", "supervisor", "robot", "server", "client", "both"]
"""Who sends a message; ``server`` is the end of a channel that listens, ``client`` one that connects."""

MOST_ITEMS = 4096
"""Largest number of items of a list in a message; a longer one is refused before anything is read."""


class Wire(NamedTuple):
    """How one field stands in the bytes of a message.

    Attributes:
        code: Format of one number, as the module struct writes it.
        unit: Unit, "-" for none.
        listed: Whether the field is a list, of which the fixed part of the message has the length.
        finite: Whether only finite real numbers are allowed, else any bits.
    """

    code: Literal["?", "B", "H", "I", "Q", "d"]
    unit: str = "-"
    listed: bool = False
    finite: bool = True


Flag = Annotated[bool, Wire("?")]
Small = Annotated[int, Wire("B")]
Index = Annotated[int, Wire("H")]
Number = Annotated[int, Wire("I")]
Word = Annotated[int, Wire("Q")]
Seconds = Annotated[float, Wire("d", "s")]
Numbers = Annotated[tuple[int, ...], Wire("I", listed=True)]
Codes = Annotated[tuple[int, ...], Wire("B", listed=True)]


class Kind(NamedTuple):
    """What a message is.

    Attributes:
        code: Its number in the header.
        channel: The channel that carries it.
        sender: Who sends it.
    """

    code: int
    channel: Channel
    sender: Role


MESSAGES: dict[int, Any] = {}
"""Every class of messages by its code."""

KINDS: dict[Any, Kind] = {}
"""What every class of messages is."""

M = TypeVar("M")


def allowed_kinds(channel: Channel, senders: Collection[Role]) -> frozenset[int]:
    """Return the codes of the messages that a sender with one of these roles may send on a channel."""
    return frozenset(
        kind.code for kind in KINDS.values() if kind.channel in ("any", channel) and kind.sender in senders
    )


def message(code: int, channel: Channel, sender: Role) -> Any:
    """Decorate a named tuple: it is a message with this code, which this sender may send on this channel."""

    def register(cls: type[M]) -> type[M]:
        if code in MESSAGES:
            raise ValueError(f"message {cls.__name__}: code {code} is taken by {MESSAGES[code].__name__}")
        MESSAGES[code], KINDS[cls] = cls, Kind(code, channel, sender)
        return cls

    return register
