"""The supervisor as a process: it answers the world's ticks, and speaks with all robots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from coop_drake.messages import Status, SupervisorEnd, Tick
from coop_drake.nodes.serving import Server
from coop_drake.nodes.supervisor_node import SupervisorNode


class SupervisorServer(Server):
    """Serves the supervisor.

    Args:
        node: The supervisor.
        end: Its sockets, with sessions.
        lock_step: Whether ticks say how many messages of each robot count.
    """

    def __init__(self, node: SupervisorNode, end: SupervisorEnd, *, lock_step: bool = True) -> None:
        super().__init__(end, end.team.peers, lock_step=lock_step)
        self._node, self._end = node, end

    def _counts(self, question: Tick) -> Mapping[int, int]:
        return dict(enumerate(question.team_messages))

    def _hear(self, sender: int, message: Any) -> None:
        self._node.hear(sender, [message])

    def _begin(self, question: Tick) -> None:
        if question.number > 0:
            self._node.forget()

    def _answer(self, question: Tick) -> None:
        number, time, node = question.number, question.time, self._node
        self._end.begin(number)
        for robot, answer in node.answers():
            self._end.team.send(robot, answer)
        cell, entry, arrived, *causes = node.look(time)
        if question.step:
            for message in node.step(time, stopped=question.stopped):
                self._end.send_to_all(message)
        sent = tuple(peer.sent if peer.session else 0 for _, peer in sorted(self._end.team.peers.items()))
        codes = tuple(int(cause) for cause in causes)
        status = Status(
            number,
            time,
            node.knows,
            sent,
            int(cell),
            float(entry),
            bool(arrived),
            codes,
            self._end.refusals.total,
        )
        self._end.efforts.send(status)
        self._end.release()
