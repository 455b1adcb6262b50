"""The supervisor: cell planner and hold supervisor, computed at samples that the world gives, its process."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from coop_drake.apart import messages as msg
from coop_drake.apart.node import AHEAD, LOSSY_COPIES, NodeProcess, SampledDiagram
from coop_drake.apart.passing import PassingSupervisor
from coop_drake.apart.transport import Ends
from coop_drake.diagram.closed_loop import add_supervisor
from coop_drake.laws.measurements import period_of, whole_periods
from coop_drake.scenario import Hold as HoldSettings
from coop_drake.systems import CellPlanner
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import whole_turns

_NOTHING = np.array([-1.0, -1.0])
"""What is heard of a robot before its first message, as in a clear channel."""


SPARE = 10
"""Samples by which the slow way takes longer than robots say [-]."""


class SupervisorNode:
    """Switches the cells of a team and holds it, by what robots report.

    While all drives brake it waits until all robots rest where they can begin the current cell anew, and
    orders that they do. Where it was started again during a run, it learns the current cell from the robots.

    Args:
        robots: Number of robots N.
        cells: Number of cells of the plan.
        period: Control period [s].
        hold: When the team is held, None for never.
    """

    def __init__(self, robots: int, cells: int, period: float, hold: HoldSettings | None) -> None:
        builder, self._period, self._robots, self._cells = DiagramBuilder(), period, robots, cells
        planner = builder.AddNamedSystem("cell_planner", CellPlanner(robots, cells, period=period))
        for k in range(robots):
            builder.ExportInput(planner.GetInputPort(f"robot_{k}_ready"), f"robot_{k}_ready")
        for name in ("current_cell", "arrived"):
            builder.ExportOutput(planner.GetOutputPort(name), name)
        self._held = hold is not None
        if hold is not None:
            supervisor = add_supervisor(builder, hold, planner, robots, period)
            for k in range(robots):
                builder.ExportInput(supervisor.GetInputPort(f"robot_{k}_request"), f"robot_{k}_request")
            for name in ("hold_message", "causes"):
                builder.ExportOutput(supervisor.GetOutputPort(name), name)
        self._sampled = SampledDiagram(builder.Build())
        self._logged = ("current_cell", "arrived", *(["causes"] if self._held else []))
        subjects = ("ready", *(["request"] if self._held else []))
        self._heard = {f"robot_{k}_{subject}": _NOTHING for k in range(robots) for subject in subjects}
        self._planner, self._place = planner, msg.Place(True, 0, 0)
        self._places, self._resting = dict[int, msg.Place](), dict[int, msg.AtRest]()
        self._order: msg.Begin | None = None
        self._stopped, self._lossy, self._since, self._number = False, False, 0, 0

    @property
    def knows(self) -> bool:
        """Whether it knows the current cell."""
        return self._place.known

    def forget(self) -> None:
        """Know no current cell: the process was started again during a run."""
        self._place = msg.Place(False, 0, 0)

    def _switch(self) -> msg.Switch:
        return msg.Switch(self._place.cell, self._place.sample)

    def answers(self) -> list[tuple[int, msg.Switch]]:
        """Return robots that have said which cell they are in, and what to answer; none until it knows it.

        A supervisor that does not know waits for all robots. They may differ where the one before it ended
        while it spoke to them; the latest cell is the current one.
        """
        if not self.knows:
            known = [place for place in self._places.values() if place.known]
            if len(self._places) < self._robots or not known:
                return []
            self._enter(*max((place.cell, place.sample) for place in known))
        said, self._places = self._places, {}
        return [(robot, self._switch()) for robot in said]

    def _enter(self, cell: int, sample: int) -> None:
        """Be in a cell, of which no robot has reported anything yet."""
        sampled = self._sampled
        sampled.diagram.SetDefaultContext(sampled.context)
        state = self._planner.GetMyMutableContextFromRoot(sampled.context).get_mutable_discrete_state_vector()
        state.SetFromVector([cell, sample * self._period])
        self._heard = dict.fromkeys(self._heard, _NOTHING)
        self._place = msg.Place(True, cell, sample)

    def look(self, time: float) -> FloatArray:
        """Return the supervisor's record for the log at an instant [s]; nothing changes."""
        self._sampled.at(time, self._heard)
        return np.concatenate([self._sampled.output(name) for name in self._logged])

    def step(self, time: float, *, stopped: bool = False) -> list[msg.Switch | msg.Hold | msg.Begin]:
        """Compute a sample, and return what all robots are told.

        Args:
            time: Time of the sample [s].
            stopped: Whether the drives brake.
        """
        number, order = period_of(time, self._period), self._order
        self._number = number
        if stopped and not self._stopped:
            self._since = number
        self._stopped = stopped
        if order is not None and number >= order.sample:
            self._order, self._since = None, order.sample
            self._enter(order.cell, order.sample)
        elif stopped or not self.knows:
            return self._gathered(number)
        self._sampled.at(time, self._heard)
        self._sampled.update()
        said: list[msg.Switch | msg.Hold | msg.Begin] = []
        cell, entry = self._sampled.output("current_cell")
        if int(cell) != self._place.cell:
            self._place = msg.Place(True, int(cell), round(entry / self._period))
            said.append(self._switch())
        elif self._lossy and 0 < number - self._place.sample <= LOSSY_COPIES:
            said.append(self._switch())
        if self._held:
            held, number = self._sampled.output("hold_message")
            said.append(msg.Hold(bool(held), int(number)))
        return said

    def _gathered(self, number: int) -> list[msg.Switch | msg.Hold | msg.Begin]:
        """Return the order to begin, once all robots have said that they rest since the drives brake."""
        robots = range(self._robots)
        resting = all(k in self._resting and self._resting[k].sample > self._since for k in robots)
        if self._order is not None or not resting or not self.knows:
            return []
        sample = number + 1 + whole_periods(AHEAD, self._period)
        told = [self._resting[k] for k in robots]
        poses = np.array([one.object_pose for one in told])
        poses[:, 2] += whole_turns(poses[:, 2], np.full(len(told), poses[0, 2]))
        pose = tuple(poses.mean(axis=0).tolist())
        # The mean of all robots' poses is another one than each of them has computed its way for.
        slow = max(one.needed for one in told) + SPARE
        self._order = msg.Begin(self._place.cell, sample, slow, pose)
        return [self._order]

    def hear(self, robot: int, messages: Iterable[Any]) -> None:
        """Take in what a robot says; it counts from the next instant on."""
        for message in messages:
            if isinstance(message, msg.Ready):
                self._heard[f"robot_{robot}_ready"] = np.array([message.cell, 0.0 if message.ready else -1.0])
                # In the first sample of a cell, reports of the cell before are still under way.
                missed = message.cell < self._place.cell and self._number - self._place.sample > 1
                if self.knows and missed:
                    self._lossy = True
                    self._places[robot] = msg.Place(True, message.cell, 0)
            elif isinstance(message, msg.HoldRequest):
                self._heard[f"robot_{robot}_request"] = np.array([message.asks, message.number], dtype=float)
            elif isinstance(message, msg.Place) and message.cell < self._cells:
                self._places[robot] = message
            elif isinstance(message, msg.AtRest) and len(message.object_pose) == 3:
                self._resting[robot] = message

    def release(self) -> None:
        """Free all memory."""
        self._sampled.release()


class SupervisorProcess(NodeProcess):
    """Answers the world for the supervisor.

    Args:
        node: The supervisor.
        ends: Its sockets, with sessions.
        robots: Number of robots.
    """

    def __init__(self, node: SupervisorNode | PassingSupervisor, ends: Ends, robots: int) -> None:
        super().__init__(ends, range(robots))
        self._node, self._robots = node, range(robots)

    def _objection(self, question: msg.Tick) -> str:
        robots = len(self._robots)
        return "" if len(question.team_messages) == robots else f"Expected {robots} numbers of messages"

    def _counts(self, question: msg.Tick) -> Mapping[int, int]:
        return dict(enumerate(question.team_messages))

    def _hear(self, sender: int, message: Any) -> None:
        self._node.hear(sender, [message])

    def _begin(self, question: msg.Tick) -> None:
        if question.number > 0:
            self._node.forget()

    def _answer(self, question: msg.Tick) -> None:
        number, time, node, ends = question.number, question.time, self._node, self._ends
        ends.sample = number
        for robot, answer in node.answers():
            ends.send(robot, answer)
        cell, entry, arrived, *causes = node.look(time).tolist()
        if question.step:
            for message in node.step(time, stopped=question.stopped):
                for robot in self._robots:
                    ends.send(robot, message)
        sent, codes = tuple(map(ends.sent, self._robots)), tuple(map(int, causes))
        refused = ends.refusals.total
        status = msg.Status(number, time, node.knows, sent, int(cell), entry, bool(arrived), codes, refused)
        ends.send(msg.WORLD, status)
        ends.release()
