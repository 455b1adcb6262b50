"""The page of the messages that cross between the processes of a team, from their types."""

from __future__ import annotations

import inspect
import re
from typing import Any

import msgspec
from msgspec.inspect import BoolType, FloatType, IntType, Metadata, StrType, VarTupleType

from coop_drake.apart.membership import TOLERATED
from coop_drake.apart.messages import (
    KINDS,
    LONGEST,
    MOST_ITEMS,
    MOST_ROBOTS,
    PROTOCOL,
    SUPERVISOR,
    WORLD,
    Goodbye,
    Hello,
    Ready,
    Reason,
    Refused,
    Welcome,
    encode,
)
from coop_drake.apart.robot import LONGEST_DOUBT
from coop_drake.laws.actuators import BASE_RATE, JOINT_DAMPING, RETURN_RATE, TURN_RATE
from coop_drake.systems.block import robot_record

_SECTIONS = (
    (
        "Sessions",
        "They open sessions and close them, and have the number 0.",
        {
            "the process that connects": (Hello,),
            "the process that listens": (Welcome, Refused),
            "the world": (Goodbye,),
        },
    ),
    (
        "Measurements",
        "What a robot measures itself, and the object's pose. No robot receives those of another one.",
        {"the world": tuple(k for (sender, _), own in KINDS.items() if sender == "world" for k in own)},
    ),
    (
        "Efforts",
        "What moves the robots, and what the log shows.",
        {"the robot": KINDS["robot", "world"], "the supervisor": KINDS["supervisor", "world"]},
    ),
    (
        "The team's messages",
        "All that crosses between robots and supervisor. A world does not see it.",
        {"the robot": KINDS["robot", "supervisor"], "the supervisor": KINDS["supervisor", "robot"][:-1]},
    ),
)

_EXAMPLE = encode(7, 1, Ready(3, ready=True)).hex(" ")

_TOP = f"""# Messages between processes

What a world in another language needs to know. [Processes of their own](../how_to/apart.md) says how to
start the others. `python -m docs.generate` makes this page from the types by which messages are checked.

## Bytes

Every message is one frame of ZeroMQ with a value of [MessagePack](https://msgpack.org): a list of three.
These are the session, the message's number, and a map of the message's fields with its name as `type`. The
first numbered message of session 7, about cell 3, is `[7, 1, {{"type": "Ready", "cell": 3, "ready":
true}}]`, in bytes `{_EXAMPLE}`.

All fields must be there, and no others. Integers have no sign and at most 32 bits. Real numbers are finite
where the type is not "any real"; whole ones may be sent as integers. Types in the plural are lists of at
most {MOST_ITEMS} items. A message has at most {LONGEST} bytes. A process has an index: k for robot k of at
most {MOST_ROBOTS}, {SUPERVISOR} for the supervisor and {WORLD} for the world.

## Connections and sessions

The world and the supervisor listen, each with a `ROUTER` socket at its address of the [address
book](../how_to/apart.md#addresses-and-keys). Robots connect to both, the supervisor to the world, each with
a `DEALER` socket, and with the CURVE keys of the book if there are any. In a team that passes from cell
to cell, robots connect to all robots with larger indices, too.

1. The process that connects draws a number for the session. It sends `Hello` with it every tenth of a second
   until the answer is `Welcome`. After `Refused` with a reason it may ask again.
2. Each end numbers its messages from 1 on. Refused are messages of another session, and numbers that are not
   larger than the one before.
3. The session ends with its connection. Until then no other connection gets the name. ZeroMQ closes a
   connection at once when its process has ended, or after two seconds without a sign of life.
4. The list of three, `Hello` with `protocol` and `Refused` with `reason` are the same in all versions of the
   protocol. This page is about version {PROTOCOL}.
"""


def message_page() -> str:
    """Return the page."""
    parts = [_TOP]
    for title, about, senders in _SECTIONS:
        shown = dict.fromkeys((sender, cls) for sender, kinds in senders.items() for cls in kinds)
        parts += [f"## {title}", "", about, ""]
        shown = {(sender, cls): None for sender, cls in shown if cls is not Goodbye or title == "Sessions"}
        parts += [_line(cls, sender, to_world=title != _SECTIONS[-1][0]) for sender, cls in shown]
        parts += [""]
    return "\n".join([*parts, _world(), _reasons()]).replace("``", "`")


def _line(cls: Any, sender: str, *, to_world: bool) -> str:
    """Return the line of one message: who sends it, and what it says; its fields, for a world in lines."""
    about, *more = (inspect.getdoc(cls) or "").split("\n\n")
    parts = re.split(r"^ {4}(\w+): ", more[-1], flags=re.MULTILINE) if more else []
    meanings = dict(zip(parts[1::2], parts[2::2], strict=True))
    described: Any = msgspec.inspect.type_info(cls)
    said = f"- **{cls.__name__}**, from {sender}: {' '.join(about.split())}"
    fields = {field.name: f"`{field.name}` ({_type(field.type)})" for field in described.fields}
    if not to_world:
        return said
    explained = (f"    - {field}: {' '.join(meanings[name].split())}" for name, field in fields.items())
    return "\n".join([said, *explained])


def _type(kind: Any) -> str:
    """Return the type of a field in a word, with its unit."""
    words: dict[Any, str] = {IntType: "integer", FloatType: "real", BoolType: "boolean", StrType: "text"}
    if isinstance(kind, VarTupleType):
        return f"{_type(kind.item_type)}s"
    if isinstance(kind, Metadata):
        return _type(kind.type) + (f" [{kind.extra['unit']}]" if kind.extra else "")
    return "any " * (isinstance(kind, FloatType) and kind.le is None) + words[type(kind)]


def _world() -> str:
    """Return what who builds another world needs to know beside the messages."""
    record = robot_record(1, holds=True, monitored=True, passes=True)
    shown = ", ".join(f"`{name}` ({size})" for name, size in record.items())
    per_mass, per_inertia = f"{BASE_RATE:.4g}", f"{TURN_RATE:.4g}"
    return f"""## Building a world

A world listens to all robots and the supervisor, sends `Sample` and `Tick`, and hears `Effort`, `Telemetry`
and `Status`. It ends the run by `Goodbye`, for example after `arrived`.

- **Samples** are numbered from 0, one for every control period. At sample 0 the team rests at the plan's
  start. To a question with `step` a robot answers by `Effort`, then by `Telemetry`, without it by
  `Telemetry` alone; the supervisor always answers by `Status`. Questions without `step` change nothing. A
  process whose first question has a number above 0 was started again: it asks for its cell with `Place`.
- **Time** is the world's. A robot with a wrong clock is told a wrong `time`. In lock-step the world waits for
  all answers; by the wall clock a sample is sent no earlier than at its time.
- **Order**: a message of the team counts from the next sample on. So every answer says in `team_messages` how
  many messages its sender has sent to each of the team, and the world hands this on: in the next `Sample` or
  `Tick` the numbers that the last `Telemetry` and `Status` had for its receiver. Before the first answer it
  is 0.
- **Stamps** lie m periods before `time` for a delay of m periods, and are 0 in the first m samples. Under a
  budget a robot asks for a hold, and after {LONGEST_DOUBT:g} s lets its drives brake, if the age of a
  measurement is wrong by more than `clock_error`, if pose and state are of different instants, if a stamp
  goes back, or if a clock jumps. Drives take no effort whose `stamp` is in the future of its sample, or older
  by more than {TOLERATED:g} s than the budget's delay and twice its `clock_error`.
- **Efforts** act on the base at the origin of Bk as (force along x of W, force along y of W, torque about
  z), then on the joints in the order of q_k. They hold from the sample's time on until the next ones.
- **Signs of life**: the world may send `Welcome` at any time. A process ends when it has heard nothing for
  30 s.
- **Digests** are compared as texts. A world that does not know them takes those of the first `Hello`.
- **Telemetry** has these `values` in their order, with their numbers for a robot with one joint: {shown}.
  `clock` is there in teams that can be held, `alarm` under a budget, the last two in teams that pass;
  `funnels` has the lower, then the upper bounds of (theta, q_k).
- **Braking**, where `stopped` is true or no effort comes in time: effort = -D (z' + {RETURN_RATE:g} /s (z -
  rest)), with `rest` of the last `Effort` that had one, else effort = -D z'. D is {per_mass} /s times the
  base's mass for both forces, {per_inertia} /s times its inertia about z through the origin of Bk for the
  torque, and {JOINT_DAMPING:g} N m s/rad or N s/m for every joint. Differences of angles are taken in [-pi,
  pi). Where actuators have limits, each of the two summands is cut to half of them, the force by its length.
- **The line** of the emergency stop is closed at the first sample in which all robots have answered with the
  states 0, 1 or 5.
"""


def _reasons() -> str:
    return f"""## What is refused

A message that departs from this page is refused and counted by its reason. The process says on
standard error what is wrong with the first malformed one.

{"".join(f"- **{reason.name.lower()}**: {reason.value}{chr(10)}" for reason in Reason)}"""
