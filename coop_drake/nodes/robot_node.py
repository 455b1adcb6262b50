"""One robot: its controller behind its radio, computed at samples that the world gives."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf
from typing import Any

import numpy as np

from coop_drake.diagram.deployment import deploy
from coop_drake.diagram.robot_controller import RobotKnowledge, build_robot_controller
from coop_drake.laws.beginning import POSITION_WAITS, widen_slice
from coop_drake.laws.departure import BRAKES
from coop_drake.laws.sampling import period_of, whole_periods
from coop_drake.messages import AtRest, Begin, Hold, HoldRequest, Place, Ready, Switch
from coop_drake.nodes.sampled import SampledDiagram, row_of
from coop_drake.nodes.states import (
    AGAIN,
    ASKS,
    FOLLOWS,
    HOLDS,
    LOSSY_REPORT_TIMEOUT,
    OUTSIDE,
    REPORT_TIMEOUT,
    STANDS,
)
from coop_drake.nodes.stillness import Stillness
from coop_drake.plant.chain import is_circle
from coop_drake.scenario import Deployment
from coop_drake.systems import axis_laws, robot_record
from coop_drake.tree.circles import whole_turns
from coop_drake.tree.pose import FloatArray

Said = list[Ready | HoldRequest | AtRest]
"""What a robot tells the supervisor."""


class RobotNode:
    """Computes one robot's efforts and messages from its own measurements and what the supervisor says.

    While its drives brake, it stands: it sets its states to those of a robot that begins the current cell at
    rest where it is, and says so where it may. On the supervisor's order it begins, as all others do. Where
    it departs from its nominal motion by far more than its monitor allows, it stands at once, so that the
    drives brake.

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
        place: The current cell as the robot knows it.
        state: Its state, see ``messages.Effort``.
    """

    def __init__(self, knowledge: RobotKnowledge, deployment: Deployment, robot: int, name: str) -> None:
        controller = build_robot_controller(knowledge)
        self._deployed = deploy(controller, deployment, robot, name, bodiless=True)
        self._controller, self._sampled = controller, SampledDiagram(self._deployed.diagram)
        self.period, self._held = knowledge.period or 0.0, knowledge.hold is not None
        self._monitored = knowledge.monitored is not None
        self._joints = knowledge.joints.stop - knowledge.joints.start
        self._state_size = 2 * (3 + self._joints)
        axes = [0, *range(1 + knowledge.joints.start, 1 + knowledge.joints.stop)]
        self._tables = [law.table for law in axis_laws(knowledge.plan, axes)]
        # Compiled here, and not while the team waits for an answer.
        widen_slice(self._tables[0][0], 0.0, np.empty_like(self._tables[0][0]))
        record = robot_record(self._joints, holds=self._held, monitored=self._monitored)
        self._logged = [name for name, size in record.items() if size]
        self._cell, self._hold_message = np.zeros(2), np.zeros(2)
        self._said, self._reported, self._told_rest = Ready(0, False), inf, -inf
        self.place, self.state = Place(True, 0, 0), FOLLOWS
        self._order: Begin | None = None
        self._still = Stillness(self.period)
        self._timeout = self._samples_of(REPORT_TIMEOUT)
        self._waits, self._number = (np.zeros(2), 0), 0
        endless = [3 + i for i, joint in enumerate(knowledge.robot.joints) if is_circle(joint)]
        self._circles = [self._state_size + 2, *endless]
        ends = [(cell.lower[axes], cell.upper[axes]) for cell in knowledge.plan.cells]
        self._turns = [(self._of_circles(lower), self._of_circles(upper)) for lower, upper in ends]
        self._near = self._of_circles(knowledge.plan.start[2:][axes])
        start = np.array(knowledge.plan.start[:3])
        self._sampled.at(0.0, self._inputs(np.concatenate([np.zeros(self._state_size), start])))
        self._deployed.prepare(self._sampled.context, start[:2])

    def _inputs(self, measured: FloatArray) -> dict[str, FloatArray]:
        own = {"robot_state": measured[: self._state_size], "object_pose": measured[self._state_size :]}
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
        self.place, self.state = Place(False, 0, 0), ASKS

    def meet(self) -> None:
        """Tell the supervisor again what holds: it may be another process, which has heard nothing yet."""
        self._said, self._reported, self._told_rest = Ready(self.place.cell, False), inf, -inf

    def look(self, time: float, measured: FloatArray) -> FloatArray:
        """Return the robot's record for the log at an instant; nothing changes.

        Args:
            time: The instant [s].
            measured: Its own state, then the object's pose, as it measures them.
        """
        self._sampled.at(time, self._inputs(self._unwrapped(measured)))
        return row_of(self._sampled, self._controller, self._logged)

    def step(
        self, time: float, measured: FloatArray, *, sample: int | None = None, stopped: bool = False
    ) -> tuple[FloatArray, Said]:
        """Compute a sample; return the effort from now on, and what the robot tells the supervisor.

        Args:
            time: Time of the sample [s].
            measured: Its own state, then the object's pose, as it measures them.
            sample: Number of the sample, that of the time by default; the robot's clock may be wrong.
            stopped: Whether the drives brake.
        """
        self._number = period_of(time, self.period) if sample is None else sample
        measured = self._unwrapped(measured)
        if self.place.known and np.isfinite(measured).all():
            self._near = np.clip(measured[self._circles], *self._turns[self.place.cell])
        if not self._follows(time, measured, stopped=stopped):
            return np.zeros(3 + self._joints), self._stand(time, measured) if self.place.known else []
        self._sampled.at(time, self._inputs(measured))
        brakes = self._monitored and row_of(self._sampled, self._controller, ["alarm"])[0] >= BRAKES
        self._sampled.update()
        position, until = self._waits
        if self._number < until:
            self._deployed.keep_position(self._sampled.context, position)
        held = self._held and self._hold_message[0] > 0.0
        self.state = STANDS if brakes else HOLDS if held else FOLLOWS
        return self._sampled.output("robot_effort"), self._messages()

    def hear(self, messages: Iterable[Any]) -> None:
        """Take in what the supervisor says; it counts from the next instant on."""
        for message in messages:
            if isinstance(message, Switch):
                if self.place.known and message.cell > self.place.cell and self._number - message.sample > 1:
                    self._timeout = self._samples_of(LOSSY_REPORT_TIMEOUT)
                if not self.place.known or message.sample > self.place.sample:
                    self._enter(message.cell, message.sample)
            elif isinstance(message, Hold):
                self._hold_message = np.array(message, dtype=float)
            elif isinstance(message, Begin) and len(message.object_pose) == 3:
                self._order = message if message.cell < len(self._tables) else None

    def _samples_of(self, timeout: float) -> int:
        """Return the number of samples of a timeout [s]; an answer takes two of them."""
        return max(2, whole_periods(timeout, self.period))

    def _enter(self, cell: int, sample: int) -> None:
        if self.state == ASKS:
            self.state, self._near = STANDS, np.mean(self._turns[cell], axis=0)
        self.place, self._cell = Place(True, cell, sample), np.array([cell, sample * self.period])

    def _follows(self, time: float, measured: FloatArray, *, stopped: bool) -> bool:
        """Whether the robot follows the plan in this sample, which it may begin anew now by an order."""
        number, order = self._number, self._order
        if not stopped or not self.place.known:
            return self.state in (FOLLOWS, HOLDS)
        if order is not None and number >= order.sample:
            self._order = None
            if number == order.sample:
                self._enter(order.cell, order.sample)
                pose = np.array(order.object_pose)
                pose[2] += whole_turns(pose[2:], self._near[:1])[0]
                self._begin(time, measured, pose)
                until = order.sample + whole_periods(POSITION_WAITS, self.period)
                self._waits = np.array(order.object_pose[:2]), until
                return True
        return False

    def _begin(self, time: float, measured: FloatArray, object_pose: FloatArray) -> float:
        """Set all states to those of a robot that begins the current cell at rest.

        Returns:
            The margin with which Delta E and the energies of all axes allow that.
        """
        self._sampled.at(time, self._inputs(measured))
        joints, table = measured[3 : 3 + self._joints], self._tables[self.place.cell]
        wide = np.empty_like(table)
        margins = [
            widen_slice(row, float(x), into)
            for row, x, into in zip(table, [object_pose[2], *joints], wide, strict=True)
        ]
        self._deployed.begin(self._sampled.context, self.place.cell, object_pose, joints, wide)
        self._said, self._reported, self._told_rest = Ready(self.place.cell, False), inf, -inf
        return float(min(row_of(self._sampled, self._controller, ["energy_margin"])[0], *margins))

    def _stand(self, time: float, measured: FloatArray) -> Said:
        """Wait as a robot that begins the current cell here and now; say so where this is allowed."""
        if self.state not in (STANDS, OUTSIDE):
            self._still.restart()
        self.state, told, self._cell = STANDS, self._told_rest, np.array([self.place.cell, time])
        margin = self._begin(time, measured, measured[self._state_size :])
        self._told_rest = told
        rates = measured[3 + self._joints : self._state_size]
        twist = self._sampled.output("object_state")[3:]
        if not self._still.sees_rest(np.concatenate([rates, twist])):
            return []
        if margin < 0.0:
            self.state = OUTSIDE
            return []
        if self._number - told < whole_periods(AGAIN, self.period):
            return []
        self._told_rest = self._number
        pose = tuple(float(part) for part in measured[self._state_size :])
        return [AtRest(self._number, pose)]

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
        if again or ready != (self._said == (cell, True)):
            self._said, self._reported = Ready(cell, bool(ready)), self._number
            said.append(self._said)
        if self._held:
            asks, number = self._sampled.output("hold_request")
            if number >= 0.0:
                said.append(HoldRequest(bool(asks > 0.0), int(number)))
        return said

    def release(self) -> None:
        """Free all memory."""
        self._sampled.release()
