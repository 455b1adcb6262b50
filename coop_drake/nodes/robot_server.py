"""A robot as a process: it answers the world's samples, and speaks with its supervisor alone."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from time import monotonic
from typing import Any

import numpy as np

from coop_drake.messages import SUPERVISOR, Effort, RobotEnd, Sample, Switch, Telemetry
from coop_drake.nodes.robot_node import RobotNode, Said
from coop_drake.nodes.serving import Server
from coop_drake.nodes.states import AGAIN
from coop_drake.tree.pose import FloatArray


class RobotServer(Server):
    """Serves one robot.

    In a session with the supervisor that begins while a run is under way, it first says which cell it is in,
    until the supervisor answers with ``Switch``.

    Args:
        node: The robot.
        end: Its sockets, with sessions.
        lock_step: Whether samples say how many messages of the supervisor count.
    """

    def __init__(self, node: RobotNode, end: RobotEnd, *, lock_step: bool = True) -> None:
        super().__init__(end, [SUPERVISOR], lock_step=lock_step)
        self._node, self._end, self._session = node, end, end.team.sessions
        self._placed, self._placing = 0, -inf
        self._stepped: int | None = None
        self._measured, self._stamps = np.zeros(0), (0.0, 0.0)

    def _receive(self, sender: int, message: Any) -> None:
        if self._end.team.sessions != self._session:
            self._session = self._end.team.sessions
            self._mail[sender].restart()
        super()._receive(sender, message)

    def _counts(self, question: Sample) -> Mapping[int, int]:
        return {SUPERVISOR: question.team_messages}

    def _hear(self, sender: int, message: Any) -> None:
        if isinstance(message, Switch):
            self._placed = self._end.team.sessions
        self._node.hear([message])

    def _begin(self, question: Sample) -> None:
        if question.number == 0:
            self._placed = self._end.team.sessions
        else:
            self._node.forget()

    def _say_place(self) -> None:
        """Say which cell this is, where the supervisor may not know, and not a moment ago."""
        now = monotonic()
        if self._placed == self._end.team.sessions or now - self._placing < AGAIN:
            return
        if self._end.team.send(self._node.place):
            self._placing = now
            self._node.meet()

    def _answer(self, question: Sample) -> None:
        number, time, node, team = question.number, question.time, self._node, self._end.team
        measured = np.array([*question.robot_state, *question.object_pose])
        self._end.begin(number)
        self._say_place()
        shown = tuple(node.look(node.instant(time, number) if question.step else time, measured))
        if question.step:
            effort, said = self._steps(question, measured)
            for message in said:
                team.send(message)
            rest = () if node.rest is None else tuple(node.rest)
            stamp = min(question.pose_stamp, question.state_stamp)
            self._end.efforts.send(Effort(number, stamp, self._sent, node.state, tuple(effort), rest))
        # What the log shows comes last: then the world knows that there is no effort if none has come.
        refused = self._end.refusals.total
        self._end.efforts.send(Telemetry(number, time, self._sent, node.state, refused, shown))
        self._end.release()

    def _steps(self, question: Sample, measured: FloatArray) -> tuple[FloatArray, Said]:
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

    @property
    def _sent(self) -> int:
        """Messages sent to the supervisor; for those of a session that is over it cannot wait."""
        return self._end.team.sent if self._end.team.session else 0
