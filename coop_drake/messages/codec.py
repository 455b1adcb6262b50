"""Messages to bytes and back; what departs from the schema is refused before it is read.

All numbers are little-endian. A message is its header, then its fixed part, then its lists. The fixed part
has the fields in their order, a list as its number of items (2 bytes). The length of the whole must be what
these say.

The header of the messages that open a session says which version of the schema and which process speaks.
In the session both are known, so that all other messages have its number, and their own one in as few bytes
as it needs. A session belongs to one connection, which is what an intruder does not have; its number tells it
from the sessions before.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Collection, Hashable
from functools import cache
from typing import Any, NamedTuple, get_args, get_type_hints

from coop_drake.messages.refusals import Reason, RefusedError
from coop_drake.messages.schema import Hello, TurnedAway, Welcome
from coop_drake.messages.wire import KINDS, MESSAGES, MOST_ITEMS, Wire

MAGIC = 0xCD0D
"""Stands in every message that opens a session."""

VERSION = 4
"""Version of the schema; grows when a message of the same bytes would mean something else."""

OPENING = frozenset(KINDS[cls].code for cls in (Hello, Welcome, TurnedAway))
"""Kinds of the messages that open a session, or refuse one."""

OPENING_HEADER = struct.Struct("<BHBB")
"""Kind, magic, version, sender: the header of a message that opens a session."""

SESSION_HEADER = struct.Struct("<BB")
"""Kind and session: the header of all other messages, then their number, see :func:`_number_bytes`."""

_MOST_NUMBER_BYTES = 5
"""Bytes of the largest number of a message, 2^32 - 1."""

LONGEST = 65536
"""No message is longer [bytes]."""


class Header(NamedTuple):
    """What stands before every message.

    Attributes:
        kind: Code of the message's class.
        sender: Index of a robot, or that of the world or supervisor; -1 in a session, which says it.
        session: What the server drew for this session, 0 before.
        sequence: Number of the message in its session and direction, from 1 on; 0 before a session.
        size: Size of the header [bytes].
    """

    kind: int
    sender: int
    session: int
    sequence: int
    size: int


class Layout(NamedTuple):
    """How the fields of a class of messages stand in its bytes.

    Attributes:
        fixed: All of the fixed part.
        wires: The fields by name.
        lists: Which of the fields are lists.
        checked: Whether some field needs a check of its values.
    """

    fixed: struct.Struct
    wires: dict[str, Wire]
    lists: tuple[int, ...]
    checked: bool


@cache
def layout_of(cls: Hashable) -> Layout:
    """Return the layout of a class of messages."""
    hints = get_type_hints(cls, include_extras=True)
    wires = {name: get_args(hint)[1] for name, hint in hints.items()}
    fixed = struct.Struct("<" + "".join("H" if wire.listed else wire.code for wire in wires.values()))
    lists = tuple(k for k, wire in enumerate(wires.values()) if wire.listed)
    return Layout(fixed, wires, lists, any(wire.code in "d?" for wire in wires.values()))


def prepare_layouts() -> None:
    """Read the layouts of all messages, which takes a millisecond for each, before a run needs them."""
    for cls in KINDS:
        layout_of(cls)


def encode(message: Any, sender: int, session: int, sequence: int) -> bytes:
    """Return a message as bytes.

    Args:
        message: A message of the schema.
        sender: Who sends it; only messages that open a session say it.
        session: The session.
        sequence: Number of the message in it.

    Raises:
        ValueError: A field has a value that the schema does not allow.
    """
    cls: Any = type(message)
    layout = layout_of(cls)
    code = KINDS[cls].code
    if code in OPENING:
        head = OPENING_HEADER.pack(code, MAGIC, VERSION, sender)
    else:
        head = SESSION_HEADER.pack(code, session) + _number_bytes(sequence)
    try:
        if not layout.lists:
            return head + layout.fixed.pack(*message)
        counted = list(message)
        parts = []
        for k, wire in enumerate(layout.wires.values()):
            if wire.listed:
                counted[k] = len(message[k])
                parts.append(struct.pack(f"<{len(message[k])}{wire.code}", *message[k]))
        return head + layout.fixed.pack(*counted) + b"".join(parts)
    except struct.error as error:
        raise ValueError(f"{message}: {error}") from error


def _number_bytes(number: int) -> bytes:
    """Return a number in seven bits a byte, the lowest first; all bytes but the last have an eighth bit."""
    parts = bytearray()
    while number > 0x7F:
        parts.append(number & 0x7F | 0x80)
        number >>= 7
    parts.append(number)
    return bytes(parts)


def _read_number(data: bytes, start: int) -> tuple[int, int]:
    """Return a number of :func:`_number_bytes` and where it ends."""
    number = 0
    for k, part in enumerate(data[start : start + _MOST_NUMBER_BYTES]):
        number |= (part & 0x7F) << 7 * k
        if part < 0x80:
            if (part == 0 and k > 0) or number >= 2**32:
                break  # Fewer bytes would do, or none: a number has one form alone.
            return number, start + k + 1
    raise RefusedError(Reason.LENGTH)


def turned_away_by_version(data: bytes, reason: int, sender: int) -> bytes | None:
    """Return the answer to a ``Hello`` of another version, in that version; None where it is no ``Hello``.

    The headers of messages that open a session and the whole of ``TurnedAway`` are the same in all versions,
    and every ``Hello`` begins with the nonce.

    Args:
        data: What came.
        reason: For ``TurnedAway``.
        sender: Who answers.
    """
    size = OPENING_HEADER.size
    if len(data) < size + 4 or data[0] != KINDS[Hello].code:
        return None
    nonce = int.from_bytes(data[size : size + 4], "little")
    answer = bytearray(encode(TurnedAway(nonce, reason), sender, 0, 0))
    answer[3] = data[3]
    return bytes(answer)


def header_of(data: bytes) -> Header:
    """Read the header of a message.

    Raises:
        RefusedError: It is no message of this version of the schema.
    """
    if not 0 < len(data) <= LONGEST:
        raise RefusedError(Reason.LENGTH)
    kind = data[0]
    if kind not in MESSAGES:
        raise RefusedError(Reason.KIND)
    if kind not in OPENING:
        if len(data) <= SESSION_HEADER.size:
            raise RefusedError(Reason.LENGTH)
        sequence, end = _read_number(data, SESSION_HEADER.size)
        return Header(kind, -1, SESSION_HEADER.unpack_from(data)[1], sequence, end)
    if len(data) < OPENING_HEADER.size:
        raise RefusedError(Reason.LENGTH)
    _, magic, version, sender = OPENING_HEADER.unpack_from(data)
    if magic != MAGIC:
        raise RefusedError(Reason.MAGIC)
    if version != VERSION:
        raise RefusedError(Reason.VERSION)
    return Header(kind, sender, 0, 0, OPENING_HEADER.size)


def decode(data: bytes, header: Header, allowed: Collection[int]) -> Any:
    """Read what follows the header of a message.

    Args:
        data: The whole message.
        header: Its header.
        allowed: Codes that its sender may send.

    Raises:
        RefusedError: The kind is not allowed, the length is not that of the kind, or a value is not allowed.
    """
    if header.kind not in allowed:
        raise RefusedError(Reason.KIND)
    cls = MESSAGES[header.kind]
    layout = layout_of(cls)
    end = header.size + layout.fixed.size
    if len(data) < end:
        raise RefusedError(Reason.LENGTH)
    values = list(layout.fixed.unpack_from(data, header.size))
    wires = tuple(layout.wires.values())
    if layout.lists:
        sizes = [values[k] * struct.calcsize(wires[k].code) for k in layout.lists]
        if any(values[k] > MOST_ITEMS for k in layout.lists) or len(data) != end + sum(sizes):
            raise RefusedError(Reason.LENGTH)
        for k, size in zip(layout.lists, sizes, strict=True):
            values[k] = struct.unpack_from(f"<{values[k]}{wires[k].code}", data, end)
            end += size
    elif len(data) != end:
        raise RefusedError(Reason.LENGTH)
    if layout.checked:
        _check(data, header.size, values, layout)
    return cls._make(values)


def _check(data: bytes, at: int, values: list[Any], layout: Layout) -> None:
    """Refuse real numbers that a field does not allow, and truth values other than 0 and 1."""
    for value, wire in zip(values, layout.wires.values(), strict=True):
        if wire.code == "d" and wire.finite:
            if not (all(map(math.isfinite, value)) if wire.listed else math.isfinite(value)):
                raise RefusedError(Reason.VALUE)
        elif wire.code == "?" and data[at] > 1:
            raise RefusedError(Reason.VALUE)
        at += 2 if wire.listed else struct.calcsize("<" + wire.code)
