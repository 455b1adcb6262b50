"""Every message between the world, the robots and their supervisor; codec.py lays out its bytes."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from coop_drake.messages.wire import Codes, Flag, Index, Number, Numbers, Seconds, Small, Wire, Word, message

WORLD, SUPERVISOR = 255, 254
"""Who sends, in the header of a message; a robot sends its own index k."""

MOST_ROBOTS = 64
"""Largest number of robots of a team."""

Pose = Annotated[tuple[float, ...], Wire("d", "m, m, rad", listed=True)]
Coordinates = Annotated[tuple[float, ...], Wire("d", "m, rad", listed=True)]
State = Annotated[tuple[float, ...], Wire("d", "m, rad, m/s, rad/s", listed=True)]
Efforts = Annotated[tuple[float, ...], Wire("d", "N, N m", listed=True)]
Values = Annotated[tuple[float, ...], Wire("d", listed=True, finite=False)]


@message(1, "any", "client")
class Hello(NamedTuple):
    """A process asks to be heard.

    Attributes:
        nonce: Random; the answer repeats it.
        scenario: First eight bytes of a digest of the scenario; both ends must have the same.
        plan: The same of the plan.
    """

    nonce: Number
    scenario: Word
    plan: Word


@message(2, "any", "server")
class Welcome(NamedTuple):
    """The answer: all further messages of this connection carry the session, in both directions.

    Attributes:
        nonce: That of the ``Hello``.
        session: Random from 1 to 255, another one than that of the session before.
    """

    nonce: Number
    session: Small


@message(3, "any", "server")
class TurnedAway(NamedTuple):
    """The answer to a ``Hello`` that cannot be granted.

    Attributes:
        nonce: That of the ``Hello``.
        reason: Why, see below.
    """

    nonce: Number
    reason: Small


@message(4, "any", "both")
class Present(NamedTuple):
    """The client's first message of a session; later a sign of life of either end that sends nothing else."""


@message(5, "any", "server")
class Goodbye(NamedTuple):
    """The run is over; the process that receives this ends.

    Attributes:
        outcome: 0: the team has arrived; 1: a check failed or it did not arrive; 2: the run was interrupted.
    """

    outcome: Small


@message(16, "sensors", "world")
class Sample(NamedTuple):
    """What one robot measures.

    Attributes:
        number: Number of the sample.
        time: What the robot's clock shows at the sample.
        step: Whether the robot updates its state now, after it has shown its outputs for the log; else it
            only shows them.
        stopped: Whether the line of the emergency stop is open, so that the drives of all robots brake.
        team_messages: In lock-step, the robot computes once it has so many messages of the supervisor in
            their session.
        pose_stamp: When the pose was measured, in the world's time; not when it was sent.
        state_stamp: When the state was measured, likewise.
        object_pose: Pose (x, y, angle) of the object's frame L in W, the angle in any turn.
        robot_state: The robot's own (z_k, z_k'), z_k = (x, y, yaw of Bk, q_k), in W, joints without limits in
            any turn.
    """

    number: Number
    time: Seconds
    step: Flag
    stopped: Flag
    team_messages: Number
    pose_stamp: Seconds
    state_stamp: Seconds
    object_pose: Pose
    robot_state: State


@message(17, "sensors", "world")
class Tick(NamedTuple):
    """The same for the supervisor, which measures nothing.

    Attributes:
        number: Number of the sample.
        time: Simulated time.
        step: Whether the supervisor updates its state now; it shows its outputs as they were before.
        stopped: Whether the line of the emergency stop is open, so that the drives of all robots brake.
        team_messages: In lock-step, it decides once it has so many messages of each robot in their session.
    """

    number: Number
    time: Seconds
    step: Flag
    stopped: Flag
    team_messages: Numbers


@message(32, "efforts", "robot")
class Effort(NamedTuple):
    """What one robot applies.

    Attributes:
        number: Number of the sample that it was computed from.
        stamp: The older of the stamps of the measurements that it rests on.
        team_messages: How many messages this robot has sent to the supervisor in this session.
        state: State of the process: 0: it follows the plan; 1: it holds; 2: its drives brake, and it waits to
            begin its cell anew; 3: it does not know the current cell; 4: it rests where it cannot begin its
            cell anew; 5: it returns slowly to its cell, on a way that no plan has proved free; 6: its
            measurements are older than the plan allows, or have stamps that cannot be.
        efforts: Base wrench and joint torques, shape (3 + n_k,).
        rest: Where the drives bring the robot to rest when the line is opened, its own z_k, shape (3 + n_k,);
            empty where it follows no nominal motion.
    """

    number: Number
    stamp: Seconds
    team_messages: Number
    state: Small
    efforts: Efforts
    rest: Coordinates = ()


@message(33, "efforts", "robot")
class Telemetry(NamedTuple):
    """What one robot shows to the log alone.

    Attributes:
        number: Number of the sample.
        time: Simulated time.
        team_messages: As in ``Effort``.
        state: As in ``Effort``.
        refused: How many messages this process has refused.
        values: In the order of the robot's outputs for the log.
    """

    number: Number
    time: Seconds
    team_messages: Number
    state: Small
    refused: Number
    values: Values


@message(34, "efforts", "supervisor")
class Status(NamedTuple):
    """What the supervisor shows to the log alone.

    Attributes:
        number: Number of the sample.
        time: Simulated time.
        knows: Whether it knows the current cell; a supervisor that was started again first learns it from
            the robots.
        team_messages: How many messages it has sent to each robot in their session.
        cell: Index of the current cell.
        entry: Simulated time at which it was entered.
        arrived: Whether all robots are ready to leave the last cell.
        causes: Why the team is held, as the block ``hold_supervisor`` shows it: the order, then each robot.
        refused: How many messages the supervisor has refused.
    """

    number: Number
    time: Seconds
    knows: Flag
    team_messages: Numbers
    cell: Index
    entry: Seconds
    arrived: Flag
    causes: Codes
    refused: Number


@message(48, "team", "robot")
class Ready(NamedTuple):
    """A robot's report, sent when it changes.

    Attributes:
        cell: Index of the cell that it is about.
        ready: Whether the robot is ready to leave it, or has arrived where it is the last one.
    """

    cell: Index
    ready: Flag


@message(49, "team", "robot")
class HoldRequest(NamedTuple):
    """A robot's request that the team be held, in every period where a scenario has holds or a plan a budget.

    Attributes:
        asks: Whether it asks for a hold.
        number: Number of the request, which grows.
    """

    asks: Flag
    number: Number


@message(50, "team", "supervisor")
class Switch(NamedTuple):
    """The current cell, sent when it changes, and as the answer to ``Place``.

    Attributes:
        cell: Index of the cell.
        sample: Number of the control period at whose begin it was entered.
    """

    cell: Index
    sample: Number


@message(51, "team", "supervisor")
class Hold(NamedTuple):
    """The supervisor's bit, in every period where a scenario has holds or a plan a budget.

    Attributes:
        held: Whether the team is held.
        number: Number of the message, which grows.
    """

    held: Flag
    number: Number


@message(52, "team", "robot")
class Place(NamedTuple):
    """Which cell a robot is in, sent once a session with the supervisor begins while a run is under way.

    It is sent again every tenth of a second until the supervisor answers with ``Switch``.

    Attributes:
        known: Whether it knows the current cell; a robot that was started again does not.
        cell: Index of the cell.
        sample: Number of the control period at whose begin it was entered.
    """

    known: Flag
    cell: Index
    sample: Number


@message(53, "team", "robot")
class AtRest(NamedTuple):
    """A robot can begin its cell anew from where it rests, sent ten times a second while the drives brake.

    Attributes:
        sample: Number of the sample.
        cells: Indices of the present cell and of its neighbours that it can begin anew from there with all
            that the plan promises; none in a plan that promises nothing.
        needed: For how many samples it goes slowly until a cell's law takes over, the most of these cells.
        object_pose: Pose (x, y, angle) of the object's frame L in W as this robot measures it, the mean over
            the time in which it was seen to rest.
    """

    sample: Number
    cells: Numbers
    needed: Number
    object_pose: Pose


@message(54, "team", "supervisor")
class Begin(NamedTuple):
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
