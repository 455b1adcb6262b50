"""The page of the messages that cross between the processes of a team, from their types."""

from __future__ import annotations

import inspect
import sys
from typing import Any

import msgspec
from msgspec.inspect import BoolType, FloatType, IntType, Metadata, StrType, VarTupleType

from coop_drake.apart.membership import TOLERATED
from coop_drake.apart.messages import (
    KINDS,
    LONGEST,
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
from coop_drake.laws.braking import BASE_RATE, JOINT_DAMPING, RETURN_RATE, TURN_RATE
from coop_drake.scenario.json_schema import field_meanings
from coop_drake.systems.team_link import robot_record

__all__ = ["message_page"]

_SECTIONS = (
    (
        "Sessions",
        "They open sessions and close them, and have the number 0.",
        {"who connects": (Hello,), "who listens": (Welcome, Refused), "the world": (Goodbye,)},
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
        "All that crosses between robots. Reports and switches are sent only when they change.",
        {"the robot": KINDS["robot", "supervisor"], "the supervisor": KINDS["supervisor", "robot"]},
    ),
)

_EXAMPLE = encode(7, 1, Ready(3, ready=True)).hex(" ")

_TOP = f"""# Messages between processes

What crosses between the processes of a team, field by field. `python -m docs.generate` makes this page from
the types by which messages are checked. [Processes of their own](../how_to/apart.md) says how to start them.

## Bytes

Every message is one frame of ZeroMQ with a value of [MessagePack](https://msgpack.org): a list of three, the
session, the message's number, and a map of the message's fields with its name as `type`. The first numbered
message of session 7, about cell 3, is `[7, 1, {{"type": "Ready", "cell": 3, "ready": true}}]`, in bytes
`{_EXAMPLE}`.

All fields must be there, and no others. Real numbers are finite where nothing else is said; they are sent
with 64 bits, or as whole numbers where they are whole. Where the type is a whole number or a truth value,
nothing else is read. A message has at most {LONGEST} bytes. A process has an index: k for robot k, of at
most {MOST_ROBOTS}, {SUPERVISOR} for the supervisor and {WORLD} for the world.

## Connections and sessions

The world and the supervisor listen, each with a `ROUTER` socket at its address of the
[address book](../how_to/apart.md#addresses-and-keys). Robots connect to both, the supervisor to the world,
each with a `DEALER` socket. Where the book has keys, these are those of CURVE, and a listener lets
only keys of the book connect. The process that listens has a session for each connection:

1. The process that connects draws a number for the session, and sends `Hello` with it, again every tenth
   of a second until there is a session. A repeated `Hello` is answered once more, and changes nothing.
2. The answer is `Welcome`, or `Refused` with a reason, after which the process may ask again. All messages of
   the connection have this session, in both directions; others are refused.
3. Each end numbers its messages from 1 on. A number that is not larger than the one before is refused:
   the message was repeated, or has been overtaken.
4. The session ends with its connection. While that is there, no other connection gets the name: ZeroMQ
   closes one whose process has ended at once, and one without a sign of life for two seconds.
5. The list of three, `Hello` with `protocol` and `Refused` with `reason` are the same in all versions of the
   protocol. This page is about version {PROTOCOL}; who speaks another one is refused with both numbers.
"""


def message_page() -> str:
    """Return the page."""
    parts = [_TOP]
    for title, about, senders in _SECTIONS:
        parts += [f"## {title}", "", about, ""]
        shown = dict.fromkeys((sender, cls) for sender, kinds in senders.items() for cls in kinds)
        parts += [_message(cls, sender) for sender, cls in shown if cls is not Goodbye or title == "Sessions"]
    return "\n".join([*parts, _world(), _reasons()]).replace("``", "`")


def _world() -> str:
    """Return what who builds another world needs to know beside the messages."""
    record = robot_record(1, holds=True, monitored=True)
    shown = ", ".join(f"`{name}` ({size})" for name, size in record.items())
    per_mass, per_inertia = f"{BASE_RATE:.4g}", f"{TURN_RATE:.4g}"
    return f"""## Building a world

A world listens to all robots and the supervisor, sends `Sample` and `Tick`, and hears `Effort`, `Telemetry`
and `Status`. It ends the run by `Goodbye`.

- **Samples** are numbered from 0, one more in every control period, and the first one is that of time 0, at
  which the team rests at the plan's start. A process whose first question has another number was started
  during a run: it asks for its cell with `Place`. Questions with `step` false change nothing, and ask for
  telemetry alone.
- **Time** is the world's. `time` is what the robot's clock shows at the sample, number times period where
  its clock is right. In lock-step the world's time waits for all answers, and for nothing else; by the wall
  clock a sample is sent no earlier than at its time.
- **Order**: a message of the team counts from the sample after the one in which it was sent. Every answer
  says how many messages its sender has sent to the team, and the next question says in `team_messages` how
  many its receiver waits for: a `Sample` the number that the last `Status` had for this robot, a `Tick` the
  numbers of the last `Telemetry` of each robot, 0 for a robot that has not answered yet.
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
- **Signs of life**: the world may send `Welcome` at any time, to see whether a connection is there. A process
  ends when it has heard nothing for 30 s.
- **Telemetry** has these values in their order, here for one joint, with the numbers of values: {shown}.
  `clock` is there in teams that can be held, `alarm` under a budget; `funnels` has the lower, then the
  upper bounds of (theta, q_k).
- **Braking**, where `stopped` is true or no effort comes in time: effort = -D (z' + {RETURN_RATE:g} /s (z -
  rest)), with `rest` of the last `Effort` that had one, else effort = -D z'. D is {per_mass} /s times the
  base's mass for both forces, {per_inertia} /s times its inertia about z through the origin of Bk for the
  torque, and {JOINT_DAMPING:g} N m s/rad or N s/m for every joint. Differences of angles are taken in [-pi,
  pi). Where actuators have limits, each of the two summands is cut to half of them, the force by its length.
- **The line** of the emergency stop is closed at the first sample in which all robots have answered with
  the states 0, 1 or 5.
"""


def _message(cls: Any, sender: str) -> str:
    """Return the section of one message."""
    about = " ".join((inspect.getdoc(cls) or "").split("\n\n")[0].split())
    lines = [f"### {cls.__name__}", "", f"From {sender}. {about}", ""]
    described: Any = msgspec.inspect.type_info(cls)
    if described.fields:
        lines += ["| field | type | unit | meaning |", "|---|---|---|---|"]
    meanings = field_meanings(cls)
    for one in described.fields:
        words, unit = _type(one.type)
        lines.append(f"| {one.name} | {words} | {unit} | {meanings[one.name]} |")
    return "\n".join([*lines, ""])


def _type(kind: Any) -> tuple[str, str]:
    """Return the type of a field in words, and its unit."""
    if isinstance(kind, Metadata):
        words, _ = _type(kind.type)
        return words, (kind.extra or {}).get("unit", "-")
    if isinstance(kind, VarTupleType):
        words, unit = _type(kind.item_type)
        return f"list of {words.replace('number', 'numbers', 1)}, at most {kind.max_length}", unit
    if isinstance(kind, IntType):
        return f"whole number up to {kind.le}", "-"
    if isinstance(kind, FloatType):
        return "real number" if kind.le == sys.float_info.max else "real number, also infinite or none", "-"
    if isinstance(kind, StrType):
        return f"text of at most {kind.max_length} characters", "-"
    assert isinstance(kind, BoolType)
    return "truth value", "-"


def _reasons() -> str:
    lines = [
        "## What is refused",
        "",
        "A message that departs from this page is refused and counted under one of these reasons; it never "
        "raises an error. What is wrong with the first malformed one, the process says on standard error.",
        "",
        *(f"- **{reason.name.lower()}**: {reason.value}" for reason in Reason),
        "",
    ]
    return "\n".join(lines)
