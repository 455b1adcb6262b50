"""The page of the messages that cross between the processes of a team, from their schema."""

from __future__ import annotations

import inspect
import struct
from typing import Any

from coop_drake.messages.agreement import REASONS
from coop_drake.messages.codec import (
    LONGEST,
    MAGIC,
    OPENING,
    OPENING_HEADER,
    SESSION_HEADER,
    VERSION,
    layout_of,
)
from coop_drake.messages.refusals import Reason
from coop_drake.messages.schema import MOST_ROBOTS, SUPERVISOR, WORLD
from coop_drake.messages.wire import KINDS, MOST_ITEMS, Kind
from coop_drake.scenario.json_schema import field_meanings

__all__ = ["message_page"]

_TYPES = {
    "?": "truth value, 0 or 1",
    "B": "whole number",
    "H": "whole number",
    "I": "whole number",
    "Q": "whole number",
    "d": "real number",
}

_CHANNELS = {
    "any": ("Sessions", "On every channel; they open sessions and close them."),
    "sensors": (
        "The channel of measurements",
        "From the world to each process alone: what a robot measures itself, and the object's pose. No robot "
        "receives the measurements of another one.",
    ),
    "efforts": (
        "The channel of efforts",
        "From each process to the world: what moves the robot, and what the log shows.",
    ),
    "team": (
        "The team's channel",
        "Between robots and supervisor: all that crosses between robots. Reports and switches are sent only "
        "when they change.",
    ),
}

_LEAST = SESSION_HEADER.size + 1
"""Size of the header of a message in a session with a number below 128 [bytes]."""

_TOP = f"""# Messages between processes

What crosses between the processes of a team, byte by byte. `python -m docs.generate` makes this page from
the classes that encode and decode messages. All numbers are little-endian; whole numbers have no sign, real
numbers are IEEE 754 with 64 bits. [Processes of their own](../how_to/apart.md) says how to start them.

## Header

A message that opens a session, `Hello`, `Welcome` or `TurnedAway`, begins with {OPENING_HEADER.size} bytes.

| byte | bytes | field | meaning |
|---|---|---|---|
| 0 | 1 | kind | which message follows, see below |
| 1 | 2 | magic | {MAGIC:#06x} |
| 3 | 1 | version | {VERSION} |
| 4 | 1 | sender | index of the robot; {WORLD} is the world, {SUPERVISOR} the supervisor |

Every other message belongs to a session, in which sender and version are known. It begins
with {_LEAST} to {_LEAST + 4} bytes.

| byte | bytes | field | meaning |
|---|---|---|---|
| 0 | 1 | kind | which message follows |
| 1 | 1 | session | what the server drew in `Welcome`, for this connection alone, in both directions |
| 2 | 1 to 5 | number | of the message in its session and direction, from 1 on |

The number stands in seven bits a byte, the lowest first; all bytes but the last have their eighth bit set.

Bytes of fields are counted from the end of the header. A message is as long as its header, its fixed
part and its lists together, never longer than {LONGEST} bytes. The fixed part has the fields in their order,
and in place of a list the number of its items, at most {MOST_ITEMS}; the lists follow in the same order. A
team has at most {MOST_ROBOTS} robots.
"""


def message_page() -> str:
    """Return the page."""
    parts = [_TOP]
    for channel, (title, about) in _CHANNELS.items():
        parts += [f"## {title}", "", about, ""]
        parts += [_message(cls, kind) for cls, kind in KINDS.items() if kind.channel == channel]
    return "\n".join([*parts, _reasons()]).replace("``", "`")


def _message(cls: Any, kind: Kind) -> str:
    layout = layout_of(cls)
    about = " ".join((inspect.getdoc(cls) or "").split("\n\n")[0].split())
    header = OPENING_HEADER.size if kind.code in OPENING else _LEAST
    size = header + layout.fixed.size
    length = (
        f"{size} bytes{'' if kind.code in OPENING else ' or more'}{' and its lists' * bool(layout.lists)}"
    )
    sender = "either end" if kind.sender == "both" else f"the {kind.sender}"
    lines = [f"### {cls.__name__}, kind {kind.code}", "", f"From {sender}; {length}. {about}", ""]
    if layout.wires:
        lines += ["| byte | bytes | field | type | unit | meaning |", "|---|---|---|---|---|---|"]
    meanings, at = field_meanings(cls), 0
    for name, wire in layout.wires.items():
        each = struct.calcsize("<" + wire.code)
        size = 2 if wire.listed else each
        kind_of_value = (
            f"list of {_TYPES[wire.code]}s, {each} {'byte' if each == 1 else 'bytes'} each"
            if wire.listed
            else _TYPES[wire.code]
        )
        lines.append(f"| {at} | {size} | {name} | {kind_of_value} | {wire.unit} | {meanings[name]} |")
        at += size
    return "\n".join([*lines, ""])


def _reasons() -> str:
    lines = [
        "## What is refused",
        "",
        "A message that departs from this page is refused and counted under one of these reasons; it never "
        "raises an error.",
        "",
        *(f"- **{reason.name.lower()}**: {reason.value}" for reason in Reason),
        "",
        "Who is turned away by `TurnedAway` is told one of these:",
        "",
        *(f"- {number}: {words}" for number, words in REASONS.items()),
        "",
    ]
    return "\n".join(lines)
