"""A robot and the supervisor of a team that passes from cell to cell, computed at samples of the world."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf
from typing import Any

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from coop_drake.apart import messages as msg
from coop_drake.apart import node as nodes
from coop_drake.apart.robot import RobotNode, Said
from coop_drake.diagram.closed_loop import add_order
from coop_drake.diagram.robot_controller import RobotKnowledge
from coop_drake.laws.words import HOLD, Schedule, first_words
from coop_drake.scenario import Deployment
from coop_drake.scenario import Hold as HoldSettings
from coop_drake.systems import Radio, WordPlanner
from coop_drake.tree.arrays import FloatArray


class _Ear:
    """The last rows of words that came from everybody, as blocks read them.

    Args:
        schedule: The schedule of the words.
        radio: How they are heard.
    """

    def __init__(self, schedule: Schedule, radio: Radio) -> None:
        self.rows = np.tile(first_words(schedule, radio.robots), radio.kept)

    def hear(self, sender: int, message: Any) -> None:
        """Take in what somebody says, by its index in messages; other messages mean nothing here."""
        place = len(self.rows) - 1 if sender == msg.SUPERVISOR else sender
        fits = isinstance(message, msg.Word) and len(message.rows) == self.rows.shape[1]
        if fits and not np.isnan(message.rows).any():
            self.rows[place] = message.rows


class PassingRobot(RobotNode):
    """Computes one robot's efforts and words from its own measurements and what all others say.

    Where its drives brake, as all do with it, the run is over: no plan says how the team comes back to its
    motion from where they bring it.

    Args:
        knowledge: This and the others are those of ``RobotNode``.
    """

    def __init__(self, knowledge: RobotKnowledge, deployment: Deployment, robot: int, name: str) -> None:
        assert knowledge.schedule is not None  # as of every robot of such a team
        assert knowledge.radio is not None
        self._ear = _Ear(knowledge.schedule, knowledge.radio)
        super().__init__(knowledge, deployment, robot, name)
        self._block = self._controller.GetSubsystemByName("robot_words")

    def _inputs(self, measured: FloatArray) -> dict[str, FloatArray]:
        own = {"robot_state": measured[: self.state_size], "object_pose": measured[self.state_size :]}
        return own | {"words": self._ear.rows.ravel()}

    def hear_from(self, sender: int, message: Any) -> None:
        """Take in what somebody says, by its index in messages."""
        self._ear.hear(sender, message)

    def instant(self, time: float, sample: int) -> float:
        """Return the time for which the robot computes a sample: what its clock shows [s]."""
        return time

    def _act(self, time: float, measured: FloatArray, *, stopped: bool) -> tuple[FloatArray, Said]:
        """Hear, decide, compute the effort, and speak."""
        if stopped or self.state not in nodes.MOVES:
            self.state = nodes.STANDS if self.place.known else self.state
            return np.zeros(3 + self._joints), []
        self._sampled.at(time, self._inputs(measured))
        self._sampled.update()
        if self._doubted:
            self._block.ask(self._block.GetMyMutableContextFromRoot(self._sampled.context))
        cell, entry = nodes.row_of(self._sampled, self._controller, ["current_cell"])
        self.place = msg.Place(True, int(cell), max(round(entry / self.period), 0))
        rows = self._sampled.output("said")
        self.state = nodes.STANDS if rows[HOLD] == -inf else nodes.FOLLOWS
        return self._sampled.output("robot_effort"), [msg.Word(tuple(rows.tolist()))]


class PassingSupervisor:
    """Starts the team, and knows when it has arrived, by what all robots say.

    Args:
        schedule: The schedule of the words.
        radio: How it hears and speaks.
        hold: When the team is held, None for never.
    """

    def __init__(self, schedule: Schedule, radio: Radio, hold: HoldSettings | None) -> None:
        builder = DiagramBuilder()
        planner = builder.AddNamedSystem("cell_planner", WordPlanner(schedule, radio))
        self._planner = planner
        add_order(builder, hold, planner)
        builder.ExportInput(planner.GetInputPort("words"), "words")
        for name in ("said", "arrived", "causes"):
            builder.ExportOutput(planner.GetOutputPort(name), name)
        self._sampled, self._ear, self.knows = (
            nodes.SampledDiagram(builder.Build(), decides=True),
            _Ear(schedule, radio),
            True,
        )

    def forget(self) -> None:
        """Know nothing: the process was started again during a run."""
        self._planner.forget(self._planner.GetMyMutableContextFromRoot(self._sampled.context))

    def answers(self) -> list[tuple[int, msg.Switch]]:
        """Return nothing: nobody asks for the current cell."""
        return []

    def look(self, time: float) -> FloatArray:
        """Return no cell, then the supervisor's record for the log at an instant [s]; nothing changes."""
        self._sampled.at(time, {"words": self._ear.rows.ravel()})
        return np.concatenate([[0.0, 0.0], self._sampled.output("arrived"), self._sampled.output("causes")])

    def step(self, time: float, *, stopped: bool = False) -> list[msg.Word]:
        """Compute a sample, and return what all robots are told; arguments as for ``SupervisorNode``."""
        if stopped:
            return []
        self._sampled.at(time, {"words": self._ear.rows.ravel()})
        self._sampled.update()
        return [msg.Word(tuple(self._sampled.output("said").tolist()))]

    def hear(self, robot: int, messages: Iterable[Any]) -> None:
        """Take in what a robot says; it counts from the next instant on."""
        for message in messages:
            self._ear.hear(robot, message)

    def release(self) -> None:
        """Free all memory."""
        self._sampled.release()
