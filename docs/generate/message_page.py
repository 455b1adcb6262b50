"""The page of the messages that cross between the processes of a team, from their schema."""

from __future__ import annotations

import inspect
import struct
from typing import Any

from coop_drake.laws.braking import BASE_RATE, JOINT_DAMPING, RETURN_RATE, TURN_RATE
from coop_drake.messages.agreement import OTHER_VERSION, REASONS
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
from coop_drake.nodes.membership import TOLERATED
from coop_drake.nodes.robot_node import LONGEST_DOUBT
from coop_drake.scenario.json_schema import field_meanings
from coop_drake.systems.team_link import robot_record

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
    return "\n".join([*parts, _world(), _reasons()]).replace("``", "`")


def _world() -> str:
    """Return what who builds another world needs to know beside the messages."""
    record = robot_record(1, holds=True, monitored=True)
    shown = ", ".join(f"`{name}` ({size})" for name, size in record.items())
    per_mass, per_inertia = f"{BASE_RATE:.4g}", f"{TURN_RATE:.4g}"
    return f"""## Building a world

A world is the server of the channels of measurements and of efforts, with `Hello` and `Welcome` on each.

- **Samples** are numbered from 0, one more in every control period, and the first one is that of time 0, at
  which the team rests at the plan's start. A process whose first question has another number was started
  during a run: it asks for its cell with `Place`. Questions with `step` 0 change nothing, and ask for
  telemetry alone.
- **Time** is the world's. `time` is what the robot's clock shows at the sample, number times period where
  its clock is right. In lock-step the world's time waits for all answers, and for nothing else; by the wall
  clock a sample is sent no earlier than at its time.
- **Stamps** are the times, by the same clock, at which the pose and the state were measured: measurements
  that are handed out m periods later have stamps m periods before `time`, and those of the first m samples
  have 0. Under a budget a robot compares them at every step. A measurement that is older or younger than it
  takes it for, by the delay of the scenario in whole periods and more than the budget's `clock_error`, or
  with this error older than the budget allows, a pose and a state of different instants, a stamp that goes
  back, and a clock that jumps let it ask for a hold, and after {LONGEST_DOUBT:g} s let the drives brake.
  Drives take no effort whose `stamp` is in the future of its sample, or older by more than {TOLERATED:g} s
  than the budget's delay and twice its `clock_error`. Under a budget a robot computes for
  number times period, whatever its clock shows.
- **Efforts** act on the base at the origin of Bk as (force along x of W, force along y of W, torque about
  z), then on the joints in the order of q_k. They hold from the sample's time on until the next ones.
- **Present** is the client's first message of every session, sent at once. It need not be sent again; the
  world sends it to see whether a connection is there. A process ends when it has heard nothing of the world
  for 30 s.
- **Telemetry** has these values in their order, here for one joint, with the numbers of values: {shown}.
  `clock` is there in teams that can be held, `alarm` under a budget; `funnels` has the lower, then the
  upper bounds of (theta, q_k).
- **Braking**, where `stopped` is 1 or no effort comes in time: effort = -D (z' + {RETURN_RATE:g} /s (z -
  rest)), with `rest` of the last `Effort` that had one, else effort = -D z'. D is {per_mass} /s times the
  base's mass for both forces, {per_inertia} /s times its inertia about z through the origin of Bk for the
  torque, and {JOINT_DAMPING:g} N m s/rad or N s/m for every joint. Differences of angles are taken in [-pi,
  pi). Where actuators have limits, each of the two summands is cut to half of them, the force by its length.
- **The line** of the emergency stop is closed at the first sample in which all robots have answered with
  the states 0, 1 or 5.
- **Versions**: headers of messages that open a session, the nonce of `Hello` and all of `TurnedAway` are
  the same in all versions. Who speaks another one is answered by `TurnedAway` with reason {OTHER_VERSION},
  in its own version.
"""


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
