"""One robot: its controller behind its radio, computed at samples that the world gives, and its process."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf
from time import monotonic
from typing import Any

import numpy as np
from shapely import Point
from shapely.ops import nearest_points

from coop_drake.answers.budget import Budget
from coop_drake.apart import messages as msg
from coop_drake.apart import node as nodes
from coop_drake.apart.transport import Ends
from coop_drake.diagram.deployment import deploy
from coop_drake.diagram.robot_controller import RobotKnowledge, build_robot_controller
from coop_drake.laws import actuators
from coop_drake.laws.axis_table import GOAL_LOWER, GOAL_UPPER, SLICE_LOWER, SLICE_UPPER, track_row
from coop_drake.laws.measurements import period_of, whole_periods
from coop_drake.plant import robot_chain
from coop_drake.plant.chain import is_circle
from coop_drake.scenario import Deployment
from coop_drake.systems import axis_laws, robot_record
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import whole_turns

Said = list[msg.Ready | msg.HoldRequest | msg.AtRest | msg.Word]
"""What a robot tells the supervisor, or words, which it tells all others."""


ROOM = 0.01
"""What a rest to which drives bring a robot leaves to the boundary of its region, and beside the departure to
the ends of slices [m or rad]: several times what errors of measurements leave."""


LONGEST_DOUBT = 0.05
"""For how long a robot asks for a hold because of its measurements' age before it lets the drives brake [s]:
with measurements 15 ms older than a plan holds for, a team that is held leaves its funnels after 0.6 s."""

_ROUNDING = 1e-6
"""Differences of times that are no difference [s]."""

_SLEWED = 1e-3
"""By how much a clock may be corrected while it runs, over the time that passes [-]."""


def certified_age(budget: Budget | None) -> float:
    """Return the largest age of measurements for which a plan holds [s]; infinite without a budget."""
    if budget is None:
        return inf
    return whole_periods(budget.delay, budget.period) * budget.period + budget.age_error


class StampCheck:
    """Compares the stamps of one robot's measurements with its clock.

    A plan holds for measurements that are as old as robots take them for, but for what the error of their
    clocks hides, and with this error no older than its budget allows. Plans without a budget promise nothing,
    and nothing is compared.

    Args:
        period: Control period [s].
        budget: The plan's budget.
        age: How old the robot takes its measurements for [s].
    """

    def __init__(self, period: float, budget: Budget | None, age: float) -> None:
        self._period, self._age, self._compares = period, age, budget is not None
        self._error = 0.0 if budget is None else budget.clock_error
        self._oldest = certified_age(budget) - self._error
        self._last: tuple[int, float, tuple[float, float]] | None = None

    def doubts(self, number: int, time: float, stamps: tuple[float, float]) -> bool:
        """Whether a measurement is older or younger than it may be, or a clock or a stamp has jumped.

        Args:
            number: Number of the sample.
            time: What the robot's clock shows [s].
            stamps: When the object's pose and the robot's state were measured [s].
        """
        if not self._compares:
            return False
        before, self._last = self._last, (number, time, stamps)
        for stamp in stamps:
            # What is measured before the start is what it was then.
            age = min(number * self._period, self._age)
            seems = time - stamp
            if not (seems <= self._oldest + _ROUNDING and abs(seems - age) <= self._error + _ROUNDING):
                return True
        if not abs(stamps[0] - stamps[1]) <= _ROUNDING:
            return True
        if before is None:
            return False
        passed = (number - before[0]) * self._period
        jumped = abs(time - before[1] - passed) > _ROUNDING + _SLEWED * passed
        return jumped or any(now < then - _ROUNDING for now, then in zip(stamps, before[2], strict=True))


@dataclass(frozen=True)
class SlowMotion:
    """The way from a rest to the middle of the goal intervals, see ``laws/actuators.py``.

    Attributes:
        begin: Number of the sample at which it begins.
        samples: For how many periods it lasts.
        axes: The object's angle and the robot's joints at its ends, shape (2, 1 + n) [rad or m].
        position: The object's position at its ends, shape (2, 2) [m].
    """

    begin: int
    samples: int
    axes: FloatArray
    position: FloatArray


class RobotNode:
    """Computes one robot's efforts and messages from its own measurements and what the supervisor says.

    While its drives brake, it stands and says where the object rests. On the supervisor's order it goes
    slowly to where its cell's law takes over, as all others do, see ``laws/actuators.py``. Where it departs
    from its nominal motion by far more than its monitor allows, it stands at once, so that the drives brake.

    Sensors may show the object's angle and joints without limits in any turn: each value counts in the turn
    in which it is nearest to the one before, kept to the current cell's interval, so that wrong values do not
    count turns; at first to the plan's start, and to the middle of the cell where the process was started
    again.

    Args:
        knowledge: What the robot knows before the run.
        deployment: How the team departs from the ideal one; sensors and actuators are part of the world.
        robot: Index k of the robot.
        name: Its name.

    Attributes:
        period: Control period [s].
        state_size: Number of values of the robot's own state.
        place: The current cell as the robot knows it.
        state: Its state, see ``messages.Effort``.
        rest: Where its drives bring it if they brake now, z_k; None where it follows no nominal motion.
    """

    def __init__(self, knowledge: RobotKnowledge, deployment: Deployment, robot: int, name: str) -> None:
        controller = build_robot_controller(knowledge)
        self._deployed = deploy(controller, deployment, robot, name, bodiless=True)
        self._controller, self._sampled = (
            controller,
            nodes.SampledDiagram(self._deployed.diagram, decides=knowledge.schedule is not None),
        )
        self.period, self._held = knowledge.period or 0.0, knowledge.hold is not None
        self._monitored = knowledge.monitored is not None
        self._joints = knowledge.joints.stop - knowledge.joints.start
        self.state_size = 2 * (3 + self._joints)
        self._axes = np.array([0, *range(1 + knowledge.joints.start, 1 + knowledge.joints.stop)])
        self._tables = [law.table for law in axis_laws(knowledge.plan, self._axes.tolist())]
        self._knowledge, self._plan, self._chain = knowledge, knowledge.plan, robot_chain(knowledge.robot)
        passes = knowledge.schedule is not None
        record = robot_record(self._joints, holds=self._held, monitored=self._monitored, passes=passes)
        self._logged = [name for name, size in record.items() if size]
        self._cell, self._hold_message = np.zeros(2), np.zeros(2)
        self._said, self._reported, self._told_rest = msg.Ready(0, False), inf, -inf
        self.place, self.state = msg.Place(True, 0, 0), nodes.FOLLOWS
        self.rest: FloatArray | None = None
        self._order: msg.Begin | None = None
        self._slow: SlowMotion | None = None
        self._doubted = 0
        self._stamps = StampCheck(self.period, knowledge.plan.budget, knowledge.measured_age)
        self._still = nodes.Stillness(self.period, nodes.LASTING)
        self._timeout = self._samples_of(nodes.REPORT_TIMEOUT)
        self._number = 0
        endless = [3 + i for i, joint in enumerate(knowledge.robot.joints) if is_circle(joint)]
        self._circles = [self.state_size + 2, *endless]
        ends = [(cell.lower[self._axes], cell.upper[self._axes]) for cell in knowledge.plan.cells]
        self._turns = [(self._of_circles(lower), self._of_circles(upper)) for lower, upper in ends]
        self._near = self._of_circles(knowledge.plan.start[2:][self._axes])
        start = np.array(knowledge.plan.start[:3])
        self._sampled.at(0.0, self._inputs(np.concatenate([np.zeros(self.state_size), start])))
        self._deployed.prepare(self._sampled.context, start[:2])

    def _inputs(self, measured: FloatArray) -> dict[str, FloatArray]:
        own = {"robot_state": measured[: self.state_size], "object_pose": measured[self.state_size :]}
        heard = {"current_cell": self._cell}
        return own | heard | ({"hold_message": self._hold_message} if self._held else {})

    def _of_circles(self, values: FloatArray) -> FloatArray:
        """Return which of the values of (theta, q...) are those of circles."""
        return values[[0, *(place - 2 for place in self._circles[1:])]]

    def _unwrapped(self, measured: FloatArray) -> FloatArray:
        """Return what is measured with circles in the turn in which they are nearest to those before."""
        turned = measured.copy()
        turned[self._circles] += whole_turns(measured[self._circles], self._near)
        return turned

    def forget(self) -> None:
        """Know no current cell: the process was started again during a run."""
        self.place, self.state, self.rest = msg.Place(False, 0, 0), nodes.ASKS, None

    def meet(self) -> None:
        """Tell the supervisor again what holds: it may be another process, which has heard nothing yet."""
        self._said, self._reported, self._told_rest = msg.Ready(self.place.cell, False), inf, -inf

    def look(self, time: float, measured: FloatArray) -> FloatArray:
        """Return the robot's record for the log at an instant; nothing changes.

        Args:
            time: The instant [s].
            measured: Its own state, then the object's pose, as it measures them.
        """
        self._sampled.at(time, self._inputs(self._unwrapped(measured)))
        return nodes.row_of(self._sampled, self._controller, self._logged)

    def step(
        self,
        time: float,
        measured: FloatArray,
        *,
        sample: int | None = None,
        stopped: bool = False,
        stamps: tuple[float, float] | None = None,
    ) -> tuple[FloatArray, Said]:
        """Compute a sample; return the effort from now on, and what the robot tells the supervisor.

        Args:
            time: Time of the sample, as the robot's clock shows it [s].
            measured: Its own state, then the object's pose, as it measures them.
            sample: Number of the sample, that of the time by default; the robot's clock may be wrong.
            stopped: Whether the drives brake.
            stamps: When the object's pose and its own state were measured [s]; None for not judged.
        """
        self._number = period_of(time, self.period) if sample is None else sample
        doubts = stamps is not None and self._stamps.doubts(self._number, time, stamps)
        self._doubted = self._doubted + 1 if doubts else 0
        if self._doubted > whole_periods(LONGEST_DOUBT, self.period) and self.place.known:
            self.state = nodes.LATE
            return np.zeros(3 + self._joints), []
        measured = self._unwrapped(measured)
        if self.place.known and np.isfinite(measured).all():
            self._near = np.clip(measured[self._circles], *self._turns[self.place.cell])
        return self._act(time, measured, stopped=stopped)

    def _act(self, time: float, measured: FloatArray, *, stopped: bool) -> tuple[FloatArray, Said]:
        """Compute a sample by what the robot measures, in turns that go on from each other."""
        if not self._moves(time, measured, stopped=stopped):
            return np.zeros(3 + self._joints), self._stand(measured) if self.place.known else []
        if self._slow is not None and not self._has_come(self._slow, time):
            return self._go_slowly(self._slow, time, measured), self._requests()
        self._sampled.at(time, self._inputs(measured))
        self._sampled.update()
        held = self._held and self._hold_message[0] > 0.0
        self.state = nodes.HOLDS if held else nodes.FOLLOWS
        return self._sampled.output("robot_effort"), self._messages()

    def hear_from(self, sender: int, message: Any) -> None:
        """Take in what somebody says, by its index in messages; it counts from the next instant on."""
        if sender == msg.SUPERVISOR:
            self.hear([message])

    def hear(self, messages: Iterable[Any]) -> None:
        """Take in what the supervisor says; it counts from the next instant on."""
        for message in messages:
            if isinstance(message, msg.Switch):
                if self.place.known and message.cell > self.place.cell and self._number - message.sample > 1:
                    self._timeout = self._samples_of(nodes.LOSSY_REPORT_TIMEOUT)
                new = not self.place.known or message.sample > self.place.sample
                if new and message.cell < len(self._tables):
                    self._enter(message.cell, message.sample)
            elif isinstance(message, msg.Hold):
                self._hold_message = np.array([message.held, message.number], dtype=float)
            elif isinstance(message, msg.Begin) and len(message.object_pose) == 3:
                self._order = message if message.cell < len(self._tables) else None

    def _samples_of(self, timeout: float) -> int:
        """Return the number of samples of a timeout [s]; an answer takes two of them."""
        return max(2, whole_periods(timeout, self.period))

    def _enter(self, cell: int, sample: int) -> None:
        if self.state == nodes.ASKS:
            self.state, self._near = nodes.STANDS, np.mean(self._turns[cell], axis=0)
        self.place, self._cell = msg.Place(True, cell, sample), np.array([cell, sample * self.period])

    def _moves(self, time: float, measured: FloatArray, *, stopped: bool) -> bool:
        """Whether the robot gives efforts in this sample, which it may begin anew now by an order."""
        number, order = self._number, self._order
        if not stopped or not self.place.known:
            return self.state in nodes.MOVES
        if order is not None and number >= order.sample:
            self._order = None
            if number == order.sample and self._still.full:
                self._enter(order.cell, order.sample)
                self._begin(order, time, measured)
                return True
        return False

    def _begin(self, order: msg.Begin, time: float, measured: FloatArray) -> None:
        """Begin the cell of an order anew: set all states to rest, and choose a way that no plan proves."""
        pose, joints = np.array(order.object_pose), self._still.mean()[: self._joints]
        pose[2] += whole_turns(pose[2:], self._near[:1])[0]
        axes, table = np.array([pose[2], *joints]), self._tables[order.cell]
        target = self._inside(order.cell, pose[:2])
        middle = 0.5 * (table[:, GOAL_LOWER] + table[:, GOAL_UPPER])
        ends = np.stack([axes, middle]), np.stack([pose[:2], target])
        self._slow = SlowMotion(order.sample, order.slow, *ends)
        self.state = nodes.RETURNS
        self._sampled.at(time, self._inputs(measured))
        self._deployed.begin(self._sampled.context, order.cell, pose, joints)
        self._said, self._reported, self._told_rest = msg.Ready(order.cell, False), inf, -inf

    def _inside(self, cell: int, position: FloatArray) -> FloatArray:
        """Return the point of a governed region, less a strip, that is nearest to a position [m]."""
        governed = self._plan.governed(cell)
        if self._knowledge.cells[cell].clearance(position) >= 0.0:
            return position
        region = next((part for part in (governed.buffer(-ROOM), governed) if not part.is_empty), governed)
        nearest = nearest_points(region, Point(position))[0]
        return np.array([nearest.x, nearest.y])

    def _stand(self, measured: FloatArray) -> Said:
        """Wait; say where the object rests once it does, and which cells the robot can begin from there."""
        if self.state not in (nodes.STANDS, nodes.OUTSIDE):
            self._still.restart()
        self.state, self._slow = nodes.STANDS, None
        rates, joints = measured[3 + self._joints : self.state_size], measured[3 : 3 + self._joints]
        seen = np.concatenate([joints, measured[self.state_size :]])
        if not self._still.sees_rest(rates, seen):
            return []
        mean, table = self._still.mean(), self._tables[self.place.cell]
        axes, position = np.array([mean[-1], *mean[: self._joints]]), mean[-3:-1]
        width = table[:, SLICE_UPPER] - table[:, SLICE_LOWER]
        outside = np.maximum(table[:, SLICE_LOWER] - axes, axes - table[:, SLICE_UPPER])
        back = float(np.hypot(*(self._inside(self.place.cell, position) - position)))
        if (outside > actuators.WIDEST_RETURN * width).any() or back > actuators.LONGEST_RETURN:
            self.state = nodes.OUTSIDE
            return []
        if self._number - self._told_rest < whole_periods(nodes.AGAIN, self.period):
            return []
        self._told_rest = self._number
        way = np.abs(axes - 0.5 * (table[:, GOAL_LOWER] + table[:, GOAL_UPPER])).max()
        needed = actuators.slow_samples(max(float(way), back), self.period)
        return [msg.AtRest(self._number, needed, tuple(float(part) for part in mean[-3:]))]

    def _has_come(self, slow: SlowMotion, time: float) -> bool:
        """Whether the slow way is over: from now on the cell's law acts, with funnels that are closed."""
        if self._number < slow.begin + slow.samples:
            return False
        self._slow, self._cell[1] = None, time - actuators.closed_after(self._tables[self.place.cell])
        return True

    def _go_slowly(self, slow: SlowMotion, time: float, measured: FloatArray) -> FloatArray:
        """Return the effort of a sample on the slow way."""
        root, table, T = self._sampled.context, self._tables[self.place.cell], self.period
        since, duration = (self._number - slow.begin) * T, slow.samples * T
        # The clock of the funnels waits, and with it all that holds change.
        self._cell, held = np.array([self.place.cell, time]), self._hold_message
        released = {"hold_message": held * [0, 1]} if self._held else {}
        self._sampled.at(time, self._inputs(measured) | released)
        x, v = self._moving(measured)
        wanted, rate, _ = actuators.slow_motion(slow.axes, since, duration)
        ahead = actuators.slow_motion(slow.axes, since + 0.5 * T, duration)[2]
        command = ahead - actuators.PULL[0] * (x - wanted) - actuators.PULL[1] * (v - rate)
        own = [track_row(row, 0.0, *state)[0] for row, *state in zip(table, x, v, strict=True)]
        self._deployed.command_axes(root, self.place.cell, command - own)
        self._sampled.update()
        self._deployed.keep_position(root, actuators.slow_motion(slow.position, since + T, duration)[0])
        return self._sampled.output("robot_effort")

    def _moving(self, measured: FloatArray) -> FloatArray:
        """Return angle and joints, then their rates, as measured, shape (2, 1 + n)."""
        n, rate = self._joints, self._sampled.output("object_state")[5]
        joints, rates = measured[3 : 3 + n], measured[6 + n : 6 + 2 * n]
        return np.array([[measured[-1], *joints], [rate, *rates]])

    def _messages(self) -> Said:
        """Return what is new: a report only where the supervisor would come to another conclusion by it.

        A report of the present cell is retransmitted after a time without a new cell: it may be lost, or the
        message of the new cell.
        """
        said: Said = []
        index, margin = self._sampled.output("ready")
        cell = int(self._cell[0])
        ready = index == cell and margin >= 0.0
        again = self._said.cell == cell and self._number - self._reported >= self._timeout
        if again or ready != (self._said == msg.Ready(cell, True)):
            self._said, self._reported = msg.Ready(cell, bool(ready)), self._number
            said.append(self._said)
        return said + self._requests()

    def _requests(self) -> Said:
        """Return the robot's request that the team be held, where the scenario has holds."""
        asks, number = self._sampled.output("hold_request") if self._held else (0.0, -1.0)
        return [msg.HoldRequest(bool(asks > 0.0), int(number))] if number >= 0.0 else []

    def release(self) -> None:
        """Free all memory."""
        self._sampled.release()


class RobotProcess(nodes.NodeProcess):
    """Answers the world for one robot.

    In a session with the supervisor that begins while a run is under way, it first says which cell it is in,
    until the supervisor answers with ``Switch``.

    Args:
        node: The robot.
        ends: Its sockets, with sessions.
        robots: Number of robots.
    """

    def __init__(self, node: RobotNode, ends: Ends, robots: int) -> None:
        self._everyone = [*range(robots), msg.SUPERVISOR]
        super().__init__(ends, [index for index in self._everyone if index in ends.sessions])
        self._node, self._team = node, ends.sessions[msg.SUPERVISOR]
        self._placed, self._placing = 0, -inf
        self._word: Any = None
        self._met = dict[int, int]()
        self._stepped: int | None = None
        self._measured, self._stamps = np.zeros(0), (0.0, 0.0)

    def _objection(self, question: msg.Sample) -> str:
        if len(question.object_pose) != 3 or len(question.robot_state) != self._node.state_size:
            return f"Expected 3 numbers of the object and {self._node.state_size} of the robot"
        if len(question.team_messages) != len(self._everyone):
            return f"Expected {len(self._everyone)} numbers of messages"
        missed = 0 if self._stepped is None else question.number - self._stepped
        return (
            ""
            if missed <= nodes.MOST_WAITING
            else f"Expected a number up to {nodes.MOST_WAITING} after the last"
        )

    def _counts(self, question: msg.Sample) -> Mapping[int, int]:
        told = dict(zip(self._everyone, question.team_messages, strict=True))
        return {index: told[index] for index in self._mail}

    def _sent(self) -> tuple[int, ...]:
        """Return how many messages each robot, then the supervisor, take of this one."""
        return tuple(self._ends.sent(index) if index in self._mail else 0 for index in self._everyone)

    def _hear(self, sender: int, message: Any) -> None:
        if isinstance(message, msg.Switch):
            self._placed = self._team.count
        self._node.hear_from(sender, message)

    def _begin(self, question: msg.Sample) -> None:
        if question.number == 0:
            self._placed = self._team.count
        else:
            self._node.forget()

    def _say_place(self) -> None:
        """Say which cell this is, where the supervisor may not know, and not a moment ago."""
        now = monotonic()
        if self._placed == self._team.count or now - self._placing < nodes.AGAIN:
            return
        if self._ends.send(msg.SUPERVISOR, self._node.place):
            self._placing = now
            self._node.meet()

    def _say_again(self) -> None:
        """Repeat the last word to those with whom there is a new session: they may be new."""
        counts = {index: self._ends.sessions[index].count for index in self._mail}
        for index, count in counts.items() if self._word is not None else ():
            if count != self._met.get(index):
                self._ends.send(index, self._word)
        self._met = counts

    def _answer(self, question: msg.Sample) -> None:
        number, time, node, ends = question.number, question.time, self._node, self._ends
        measured = np.array([*question.robot_state, *question.object_pose])
        ends.sample = number
        self._say_place()
        self._say_again()
        shown = tuple(node.look(time, measured).tolist())
        if question.step:
            effort, said = self._steps(question, measured)
            for message in said:
                words = isinstance(message, msg.Word)
                self._word = message if words else None
                for index in self._mail if words else [msg.SUPERVISOR]:
                    ends.send(index, message)
            rest = () if node.rest is None else tuple(node.rest.tolist())
            stamp, sent = min(question.pose_stamp, question.state_stamp), self._sent()
            stamp = stamp if number else min(stamp, time)  # A wrong clock may be ahead of the start.
            ends.send(msg.WORLD, msg.Effort(number, stamp, sent, node.state, tuple(effort.tolist()), rest))
        # What the log shows comes last: then the world knows that there is no effort if none has come.
        sent, refused = self._sent(), ends.refusals.total
        ends.send(msg.WORLD, msg.Telemetry(number, time, sent, node.state, refused, shown))
        ends.release()

    def _steps(self, question: msg.Sample, measured: FloatArray) -> tuple[FloatArray, Said]:
        """Compute a sample, and before it with the last measurements those of which nothing was heard."""
        said: Said = []
        missed = 0 if self._stepped is None or question.stopped else question.number - self._stepped - 1
        for late in range(missed, 0, -1):
            time, number = question.time - late * self._node.period, question.number - late
            said += self._node.step(time, self._measured, sample=number, stamps=self._stamps)[1]
        self._stepped, self._measured = question.number, measured
        self._stamps = question.pose_stamp, question.state_stamp
        effort, new = self._node.step(
            question.time, measured, sample=question.number, stopped=question.stopped, stamps=self._stamps
        )
        return effort, said + new
