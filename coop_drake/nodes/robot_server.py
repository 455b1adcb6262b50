"""A robot as a process: it answers the world's samples, and speaks with its supervisor alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from coop_drake.messages import SUPERVISOR, Effort, RobotEnd, Sample, Telemetry
from coop_drake.nodes.robot_node import RobotNode
from coop_drake.nodes.serving import Server


class RobotServer(Server):
    """Serves one robot.

    Args:
        node: The robot.
        end: Its sockets, with sessions.
        lock_step: Whether samples say how many messages of the supervisor count.
    """

    def __init__(self, node: RobotNode, end: RobotEnd, *, lock_step: bool = True) -> None:
        super().__init__(end, [SUPERVISOR], lock_step=lock_step)
        self._node, self._end, self._session = node, end, end.team.sessions

    def _receive(self, sender: int, message: Any) -> None:
        if self._end.team.sessions != self._session:
            self._session = self._end.team.sessions
            self._mail[sender].restart()
        super()._receive(sender, message)

    def _counts(self, question: Sample) -> Mapping[int, int]:
        return {SUPERVISOR: question.team_messages}

    def _hear(self, sender: int, message: Any) -> None:
        self._node.hear([message])

    def _answer(self, question: Sample) -> None:
        number, time = question.number, question.time
        measured = np.array([*question.robot_state, *question.object_pose])
        self._end.efforts.send(Telemetry(number, time, tuple(self._node.look(time, measured))))
        if not question.step:
            return
        effort, said = self._node.step(time, measured)
        for message in said:
            self._end.team.send(message)
        self._end.efforts.send(Effort(number, self._end.team.sent, self._node.state, tuple(effort)))
