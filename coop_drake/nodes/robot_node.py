"""One robot: its controller behind its radio, computed at samples that the world gives."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from coop_drake.diagram.deployment import deploy
from coop_drake.diagram.robot_controller import RobotKnowledge, build_robot_controller
from coop_drake.messages import Hold, HoldRequest, Ready, Switch
from coop_drake.nodes.sampled import SampledDiagram, row_of
from coop_drake.scenario import Deployment
from coop_drake.systems import robot_record
from coop_drake.tree.pose import FloatArray

FOLLOWS, HOLDS = range(2)
"""States of a robot, see ``messages.Effort``."""


class RobotNode:
    """Computes one robot's efforts and messages from its own measurements and what the supervisor says.

    Args:
        knowledge: What the robot knows before the run.
        deployment: How the team departs from the ideal one; sensors and actuators are part of the world.
        robot: Index k of the robot.
        name: Its name.
    """

    def __init__(self, knowledge: RobotKnowledge, deployment: Deployment, robot: int, name: str) -> None:
        controller = build_robot_controller(knowledge)
        deployed = deploy(controller, deployment, robot, name, bodiless=True)
        self._controller, self._sampled = controller, SampledDiagram(deployed.diagram)
        self._period, self._held = knowledge.period or 0.0, knowledge.hold is not None
        joints = knowledge.joints.stop - knowledge.joints.start
        self._state_size = 2 * (3 + joints)
        self._logged = [name for name, size in robot_record(joints, holds=self._held).items() if size]
        self._cell, self._hold_message = np.zeros(2), np.zeros(2)
        self._said = Ready(0, False)
        start = np.array(knowledge.plan.start[:3])
        self._sampled.at(0.0, self._inputs(np.concatenate([np.zeros(self._state_size), start])))
        deployed.prepare(self._sampled.context)

    def _inputs(self, measured: FloatArray) -> dict[str, FloatArray]:
        own = {"robot_state": measured[: self._state_size], "object_pose": measured[self._state_size :]}
        heard = {"current_cell": self._cell}
        return own | heard | ({"hold_message": self._hold_message} if self._held else {})

    @property
    def state(self) -> int:
        """The state of the robot as its efforts say it, see ``messages.Effort``."""
        return HOLDS if self._held and self._hold_message[0] > 0.0 else FOLLOWS

    def look(self, time: float, measured: FloatArray) -> FloatArray:
        """Return the robot's record for the log at an instant; nothing changes.

        Args:
            time: The instant [s].
            measured: Its own state, then the object's pose, as it measures them.
        """
        self._sampled.at(time, self._inputs(measured))
        return row_of(self._sampled, self._controller, self._logged)

    def step(self, time: float, measured: FloatArray) -> tuple[FloatArray, list[Ready | HoldRequest]]:
        """Compute a sample; return the effort from now on, and what the robot tells the supervisor."""
        self._sampled.at(time, self._inputs(measured))
        self._sampled.update()
        return self._sampled.output("robot_effort"), self._messages()

    def hear(self, messages: Iterable[Any]) -> None:
        """Take in what the supervisor says; it counts from the next instant on."""
        for message in messages:
            if isinstance(message, Switch):
                self._cell = np.array([message.cell, message.sample * self._period])
            elif isinstance(message, Hold):
                self._hold_message = np.array(message, dtype=float)

    def _messages(self) -> list[Ready | HoldRequest]:
        """Return what is new: a report only where the supervisor would come to another conclusion by it."""
        said: list[Ready | HoldRequest] = []
        index, margin = self._sampled.output("ready")
        cell = int(self._cell[0])
        ready = index == cell and margin >= 0.0
        if ready != (self._said == (cell, True)):
            self._said = Ready(cell, bool(ready))
            said.append(self._said)
        if self._held:
            asks, number = self._sampled.output("hold_request")
            if number >= 0.0:
                said.append(HoldRequest(bool(asks > 0.0), int(number)))
        return said

    def release(self) -> None:
        """Free all memory."""
        self._sampled.release()
