"""Every message between the world, the robots and their supervisor, in bytes of MessagePack."""

from __future__ import annotations

import sys
from collections import Counter
from enum import Enum
from functools import cache
from typing import Annotated, Any, Literal, Union

from msgspec import DecodeError, Meta, Struct
from msgspec.msgpack import Decoder, Encoder

PROTOCOL = 7
"""Version of the protocol; grows when a message of the same fields would mean something else."""

WORLD, SUPERVISOR = 255, 254
"""Indices of the world and the supervisor in messages; a robot has its own index k."""

MOST_ROBOTS = 64
"""Largest number of robots of a team."""

LONGEST = 65536
"""No message is longer [bytes]."""

MOST_ITEMS = 4096
"""Largest number of items of a list; a longer one is refused before it is read."""

Channel = Literal["sensors", "efforts", "team"]
"""What carries messages: those of the world, those to the world, those between robots and supervisor."""

_LARGEST = sys.float_info.max
Small = Annotated[int, Meta(ge=0, le=2**8 - 1)]
Index = Annotated[int, Meta(ge=0, le=2**16 - 1)]
Number = Annotated[int, Meta(ge=0, le=2**32 - 1)]
Digest = Annotated[str, Meta(max_length=64)]
Words = Annotated[str, Meta(max_length=200, pattern=r"^[ -~]*\Z")]
_Finite = Annotated[float, Meta(ge=-_LARGEST, le=_LARGEST)]
_LIST = Meta(max_length=MOST_ITEMS)
Seconds = Annotated[_Finite, Meta(extra={"unit": "s"})]
Numbers = Annotated[tuple[Number, ...], _LIST]
Codes = Annotated[tuple[Small, ...], _LIST]
Pose = Annotated[tuple[_Finite, ...], _LIST, Meta(extra={"unit": "m, m, rad"})]
Coordinates = Annotated[tuple[_Finite, ...], _LIST, Meta(extra={"unit": "m, rad"})]
State = Annotated[tuple[_Finite, ...], _LIST, Meta(extra={"unit": "m, rad, m/s, rad/s"})]
Efforts = Annotated[tuple[_Finite, ...], _LIST, Meta(extra={"unit": "N, N m"})]
Values = Annotated[tuple[float, ...], _LIST]


class Message(Struct, frozen=True, tag=True, forbid_unknown_fields=True):
    """A message, in bytes a map of its fields with its name as ``type``."""


class Hello(Message, frozen=True):
    """The first message of every connection, which asks for a session; sent again until there is an answer.

    Attributes:
        protocol: Version of the protocol.
        sender: Index of the process.
        scenario: Digest of the scenario, the same in all processes.
        plan: Likewise of the plan.
    """

    protocol: Number
    sender: Small
    scenario: Digest
    plan: Digest


class Welcome(Message, frozen=True):
    """There is a session; later a sign of life, which has no effect and no answer."""


class Refused(Message, frozen=True):
    """There is no session; the process may ask again.

    Attributes:
        reason: Why, in words.
    """

    reason: Words


class Goodbye(Message, frozen=True):
    """The run is over; the process that receives this ends.

    Attributes:
        outcome: 0: the team has arrived; 1: a check failed or it did not arrive; 2: the run was interrupted.
    """

    outcome: Small


class Sample(Message, frozen=True):
    """What one robot measures.

    Attributes:
        number: Number of the sample.
        time: What the robot's clock shows at the sample.
        step: Whether the robot computes an effort; if not, it only shows what it would log.
        stopped: Whether the line of the emergency stop is open, so that all drives brake.
        team_messages: How many messages of each robot, then of the supervisor, in their sessions the robot
            must have before it answers; 0 for itself.
        pose_stamp: When the pose was measured, in the world's time; not when it was sent.
        state_stamp: When the state was measured, likewise.
        object_pose: Pose (x, y, angle) of the object's frame L in W, the angle in any turn.
        robot_state: The robot's own (z_k, z_k'), z_k = (x, y, yaw of Bk, q_k), in W, joints without limits in
            any turn.
    """

    number: Number
    time: Seconds
    step: bool
    stopped: bool
    team_messages: Numbers
    pose_stamp: Seconds
    state_stamp: Seconds
    object_pose: Pose
    robot_state: State


class Tick(Message, frozen=True):
    """The same for the supervisor, which measures nothing.

    Attributes:
        number: As in ``Sample``.
        time: Time of the sample.
        step: Whether the supervisor decides; if not, it only shows what it would log.
        stopped: As in ``Sample``.
        team_messages: How many messages of each robot it must have before it answers.
    """

    number: Number
    time: Seconds
    step: bool
    stopped: bool
    team_messages: Numbers


class Effort(Message, frozen=True):
    """What one robot applies.

    Attributes:
        number: Number of the sample that it was computed from.
        stamp: The older of the stamps of the measurements that it rests on.
        team_messages: How many messages this robot has sent to each robot, then to the supervisor, in their
            sessions.
        state: 0: the robot follows the plan; 1: it holds; 2: its drives brake, and it waits to begin its cell
            anew; 3: it does not know the current cell; 4: it rests where it cannot begin its cell anew; 5: it
            returns slowly to its cell, on a way that no plan has proved free; 6: its measurements are older
            than the plan allows, or have stamps that cannot be.
        efforts: Base wrench and joint efforts, shape (3 + n_k,).
        rest: Where drives that brake bring the robot to rest, its own z_k, shape (3 + n_k,); empty where it
            follows no nominal motion.
    """

    number: Number
    stamp: Seconds
    team_messages: Numbers
    state: Small
    efforts: Efforts
    rest: Coordinates


class Telemetry(Message, frozen=True):
    """What one robot shows to the log alone.

    Attributes:
        number: As in the question.
        time: As in the question.
        team_messages: As in ``Effort``.
        state: As in ``Effort``.
        refused: How many messages this process has refused.
        values: What it logs, see below.
    """

    number: Number
    time: Seconds
    team_messages: Numbers
    state: Small
    refused: Number
    values: Values


class Status(Message, frozen=True):
    """What the supervisor shows to the log alone.

    Attributes:
        number: As in the question.
        time: As in the question.
        knows: Whether it knows the current cell; a supervisor that was started again does not at first.
        team_messages: How many messages it has sent to each robot in their session.
        cell: Index of the current cell; 0 where the team passes, and each robot is in a cell of its own.
        entry: Time at which this cell was entered; likewise.
        arrived: Whether all robots have said that they have arrived in the last cell.
        causes: Why the team is held, by an order (1), then for each robot: 0: no cause; 2: it asks; 3: it is
            not heard; 4: its drives shall brake. Empty where neither the scenario has holds nor the plan a
            budget.
        refused: How many messages it has refused.
    """

    number: Number
    time: Seconds
    knows: bool
    team_messages: Numbers
    cell: Index
    entry: Seconds
    arrived: bool
    causes: Codes
    refused: Number


class Ready(Message, frozen=True):
    """A robot's report, sent when it changes.

    Attributes:
        cell: Index of the cell that it is about.
        ready: Whether the robot is ready to leave it, or has arrived where it is the last one.
    """

    cell: Index
    ready: bool


class HoldRequest(Message, frozen=True):
    """A robot's request that the team be held, in every period where a scenario has holds.

    Attributes:
        asks: Whether it asks for a hold.
        number: Number of the request, which grows.
    """

    asks: bool
    number: Number


class Switch(Message, frozen=True):
    """The current cell, sent when it changes, and as the answer to ``Place``.

    Attributes:
        cell: Index of the cell.
        sample: Number of the control period at whose begin it was entered.
    """

    cell: Index
    sample: Number


class Hold(Message, frozen=True):
    """The supervisor's bit, in every period where a scenario has holds.

    Attributes:
        held: Whether the team is held.
        number: Number of the message, which grows.
    """

    held: bool
    number: Number


class Place(Message, frozen=True):
    """Which cell a robot is in, sent once a session with the supervisor begins while a run is under way.

    It is sent again every tenth of a second until the supervisor answers with ``Switch``.

    Attributes:
        known: Whether it knows the current cell; a robot that was started again does not.
        cell: Index of the cell.
        sample: Number of the control period at whose begin it was entered.
    """

    known: bool
    cell: Index
    sample: Number


class AtRest(Message, frozen=True):
    """A robot can begin its cell anew from where it rests, sent ten times a second while the drives brake.

    Attributes:
        sample: Number of the sample.
        needed: For how many samples it goes slowly until the cell's law takes over.
        object_pose: Pose (x, y, angle) of the object's frame L in W as this robot measures it, the mean over
            the time in which it was seen to rest.
    """

    sample: Number
    needed: Number
    object_pose: Pose


class Begin(Message, frozen=True):
    """All robots begin the current cell anew from rest, at the same sample and from the same pose.

    Each of them goes slowly from this pose and its own joints to the middle of the goal intervals. Then the
    cell's law takes over, in all of them at the same sample.

    Attributes:
        cell: Index of the cell.
        sample: Number of the sample at which they begin.
        slow: For how many samples they go slowly, the most that one of them needs.
        object_pose: Pose (x, y, angle) of the object's frame L in W, the mean of what all have reported.
    """

    cell: Index
    sample: Number
    slow: Number
    object_pose: Pose


class Word(Message, frozen=True):
    """What a robot or the supervisor of a team that passes says to all others in every period.

    Attributes:
        rows: Those of the last samples, the newest first, so many as may be under way. Each has the numbers
            of the start and of the plan, when it was said by the own clock [s], what its sender does, the
            cell that it has begun, where the team shall brake, where it rests, when it starts [s], and
            whether it has an alarm, see ``coop_drake/laws/words.py``.
    """

    rows: Values


Received = tuple[int, int, Any]
"""Session, number and message, as they stand in the bytes of a message."""

KINDS: dict[tuple[str, str], tuple[type[Message], ...]] = {
    ("world", "robot"): (Sample, Goodbye),
    ("world", "supervisor"): (Tick, Goodbye),
    ("robot", "world"): (Effort, Telemetry),
    ("supervisor", "world"): (Status,),
    ("robot", "supervisor"): (Ready, HoldRequest, Place, AtRest, Word),
    ("supervisor", "robot"): (Switch, Hold, Begin, Word),
    ("robot", "robot"): (Word,),
}
"""Messages from one kind of process to another, beside those that open a session."""

UNNUMBERED = (Hello, Welcome, Refused, Goodbye)
"""Messages of the session itself; they have the number 0."""


def name_of(index: int) -> str:
    """Return the name of a process by its index in messages."""
    return {WORLD: "the world", SUPERVISOR: "the supervisor"}.get(index, f"robot {index}")


def channel_of(sender: int, receiver: int) -> Channel:
    """Return the channel of the messages from one process to another."""
    return "sensors" if sender == WORLD else "efforts" if receiver == WORLD else "team"


def kinds_of(sender: int, receiver: int) -> tuple[type[Message], ...]:
    """Return the messages that one process may send to another; the larger index of two listens."""
    role = {WORLD: "world", SUPERVISOR: "supervisor"}
    opening = (Welcome, Refused) if sender > receiver else (Hello,)
    return opening + KINDS[role.get(sender, "robot"), role.get(receiver, "robot")]


@cache
def decoder_of(sender: int, receiver: int) -> Decoder[Received]:
    """Return what reads the messages that one process may send to another."""
    made: Decoder[Received] = _decoder(Union[kinds_of(sender, receiver)])  # noqa: UP007
    return made


def _decoder(kinds: Any) -> Any:
    return Decoder(tuple[Number, Number, kinds])


class _AnyHello(Struct, tag="Hello"):
    """What a ``Hello`` has in all versions of the protocol."""

    protocol: Number


_HELLO, _ANY_HELLO, _ENCODER = _decoder(Hello), _decoder(_AnyHello), Encoder()


def encode(session: int, number: int, message: Message) -> bytes:
    """Return the bytes of a message."""
    return _ENCODER.encode((session, number, message))


def decode(data: bytes, decoder: Decoder[Received] = _HELLO) -> Received:
    """Read a message.

    Args:
        data: Its bytes.
        decoder: Knows which messages the sender may send; by default ``Hello`` alone.

    Raises:
        RefusedError: It is no such message.
    """
    try:
        return decoder.decode(data)
    except (DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RefusedError(Reason.MALFORMED, str(error)) from error


def protocol_of(data: bytes) -> tuple[int, int] | None:
    """Return session and protocol of a ``Hello`` of any version of the protocol, None of anything else."""
    try:
        session, _, hello = decode(data, _ANY_HELLO)
    except RefusedError:
        return None
    return session, hello.protocol


class Reason(Enum):
    """Why a message was refused."""

    MALFORMED = "not as this page says, or a message that its sender may not send here"
    VERSION = "a Hello of another version of the protocol"
    SENDER = "a Hello of an unknown process, or with the key of another one"
    SESSION = "no session: before Hello was answered, or of another connection"
    SEQUENCE = "its number has been passed: repeated or late"
    VALUE = "an answer that does not fit its question"
    STAMP = "an effort that rests on measurements that are too old, or of the future"
    FLOOD = "more messages of one sender than a team has between two samples"
    HANDSHAKE = "a connection that does not speak ZeroMQ, or has no allowed key"


class RefusedError(ValueError):
    """A message is refused; never leaves the receiving end.

    Args:
        reason: Why.
        detail: What is wrong with it, where it is malformed.
    """

    def __init__(self, reason: Reason, detail: str = "") -> None:
        self.reason, self.detail = reason, detail
        super().__init__(detail or reason.value)


class Refusals:
    """Counts refused messages, and says on standard error what is wrong with the first malformed one.

    Args:
        name: Name of the process that refuses them.

    Attributes:
        counts: Number of messages by reason.
    """

    def __init__(self, name: str = "") -> None:
        self.counts: Counter[Reason] = Counter()
        self._name = name

    def add(self, refused: RefusedError) -> None:
        """Count one."""
        if refused.detail and not self.counts[refused.reason]:
            words = "".join(c if c.isprintable() else "?" for c in refused.detail)
            sys.stderr.write(f"{self._name} refused a message, and goes on: {words[:300]}\n")
        self.counts[refused.reason] += 1

    @property
    def total(self) -> int:
        """Number of all refused messages."""
        return self.counts.total()
