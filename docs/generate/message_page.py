"""The page of the messages that cross between the processes of a team, from their types."""

from __future__ import annotations

import inspect
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
from coop_drake.systems.messages import robot_record

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
        "All that crosses between robots. Reports and switches are sent only when they change.",
        {"the robot": KINDS["robot", "supervisor"], "the supervisor": KINDS["supervisor", "robot"]},
    ),
)

_EXAMPLE = encode(7, 1, Ready(3, ready=True)).hex(" ")

_TOP = f"""# Messages between processes

What a world in another language needs to know. What each field means stands with the types by which
messages are checked, in `messages.py` of [apart](../../coop_drake/apart). [Processes of their
own](../how_to/apart.md) says how to start them. `python -m docs.generate` makes this page.

## Bytes

Every message is one frame of ZeroMQ with a value of [MessagePack](https://msgpack.org): a list of three.
These are the session, the message's number, and a map of the message's fields with its name as `type`. The
first numbered message of session 7, about cell 3, is `[7, 1, {{"type": "Ready", "cell": 3, "ready":
true}}]`, in bytes `{_EXAMPLE}`.

All fields must be there, and no others. Integers have no sign and at most 32 bits. Real numbers are finite
where the type is not "any real"; whole ones may be sent as integers. Lists have at most {MOST_ITEMS} items,
a message at most {LONGEST} bytes. A process has an index: k for robot k, of at most {MOST_ROBOTS},
{SUPERVISOR} for the supervisor and {WORLD} for the world.

## Connections and sessions

The world and the supervisor listen, each with a `ROUTER` socket at its address of the [address
book](../how_to/apart.md#addresses-and-keys). Robots connect to both, the supervisor to the world, each with
a `DEALER` socket, and with the CURVE keys of the book if there are any.

1. The process that connects draws a number for the session. It sends `Hello` with it every tenth of a second
   until there is a session.
2. The answer is `Welcome`, or `Refused` with a reason, after which the process may ask again. Messages of
   another session are refused.
3. Each end numbers its messages from 1 on. A number that is not larger than the one before is refused.
4. The session ends with its connection. Until then no other connection gets the name. ZeroMQ closes a
   connection at once when its process has ended, or after two seconds without a sign of life.
5. The list of three, `Hello` with `protocol` and `Refused` with `reason` are the same in all versions of the
   protocol. This page is about version {PROTOCOL}.
"""


def message_page() -> str:
    """Return the page."""
    parts = [_TOP]
    for title, about, senders in _SECTIONS:
        shown = dict.fromkeys((sender, cls) for sender, kinds in senders.items() for cls in kinds)
        parts += [f"## {title}", "", about, ""]
        parts += [_line(cls, sender) for sender, cls in shown if cls is not Goodbye or title == "Sessions"]
        parts += [""]
    return "\n".join([*parts, _world(), _reasons()]).replace("``", "`")


def _line(cls: Any, sender: str) -> str:
    """Return the line of one message: who sends it, what it says, and its fields."""
    about = " ".join((inspect.getdoc(cls) or "").split("\n\n")[0].split())
    described: Any = msgspec.inspect.type_info(cls)
    fields = ", ".join(f"`{field.name}` ({_type(field.type)})" for field in described.fields)
    return f"- **{cls.__name__}**, from {sender}: {about}" + (f" Fields: {fields}." if fields else "")


def _type(kind: Any) -> str:
    """Return the type of a field in a word, with its unit."""
    words: dict[Any, str] = {IntType: "integer", FloatType: "real", BoolType: "truth value", StrType: "text"}
    if isinstance(kind, VarTupleType):
        return f"list of {_type(kind.item_type)}s"
    if isinstance(kind, Metadata):
        return _type(kind.type) + (f" [{kind.extra['unit']}]" if kind.extra else "")
    return "any " * (isinstance(kind, FloatType) and kind.le is None) + words[type(kind)]


def _world() -> str:
    """Return what who builds another world needs to know beside the messages."""
    record = robot_record(1, holds=True, monitored=True)
    shown = ", ".join(f"`{name}` ({size})" for name, size in record.items())
    per_mass, per_inertia = f"{BASE_RATE:.4g}", f"{TURN_RATE:.4g}"
    return f"""## Building a world

A world listens to all robots and the supervisor, sends `Sample` and `Tick`, and hears `Effort`, `Telemetry`
and `Status`. It ends the run by `Goodbye`.

- **Samples** are numbered from 0, one for every control period. At sample 0 the team rests at the plan's
  start. A process whose first question has another number asks for its cell with `Place`. Questions with
  `step` false change nothing, and ask for telemetry alone.
- **Time** is the world's. `time` is what the robot's clock shows at the sample. In lock-step the world waits
  for all answers; by the wall clock a sample is sent no earlier than at its time.
- **Order**: a message of the team counts from the next sample on. Every answer says how many messages its
  sender has sent to the team. The next question says in `team_messages` how many messages its
  receiver must have before it answers. In a `Sample` this is the number that the last `Status` had for this
  robot. In a `Tick` these are the numbers of the last `Telemetry` of each robot. Before the first answer it
  is 0.
- **Stamps** are the times, by the robot's clock, at which pose and state were measured: m periods before
  `time` for a delay of m periods, 0 in the first m samples. Under a budget a robot asks for a hold, and
  after {LONGEST_DOUBT:g} s lets its drives brake, if a measurement's age is wrong by more than
  `clock_error`, if pose and state are of different instants, if a stamp goes back, or if a clock jumps.
  Drives take no effort whose `stamp` is in the future of its sample, or older by more than {TOLERATED:g} s
  than the budget's delay and twice its `clock_error`.
- **Efforts** act on the base at the origin of Bk as (force along x of W, force along y of W, torque about
  z), then on the joints in the order of q_k. They hold from the sample's time on until the next ones.
- **Signs of life**: the world may send `Welcome` at any time. A process ends when it has heard nothing for
  30 s.
- **Telemetry** has these values in their order, here for one joint, with the numbers of values: {shown}.
  `clock` is there in teams that can be held, `alarm` under a budget; `funnels` has the lower, then the upper
  bounds of (theta, q_k).
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

A message that departs from this page is refused and counted under one of these reasons. The
process says on standard error what is wrong with the first malformed one.

{"".join(f"- **{reason.name.lower()}**: {reason.value}{chr(10)}" for reason in Reason)}"""
