"""A robot and the supervisor of a team that passes from cell to cell, computed at samples of the world."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf, pi, tau
from typing import Any

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from coop_drake.apart import messages as msg
from coop_drake.apart import node as nodes
from coop_drake.apart.robot import ROOM, RobotNode, Said
from coop_drake.diagram.closed_loop import add_order
from coop_drake.diagram.robot_controller import RobotKnowledge
from coop_drake.laws.motion import motion_at, place_on_axes
from coop_drake.laws.readiness import BRAKES, QUIET
from coop_drake.laws.robot_dynamics import PX, PY, motion_room, write_motion
from coop_drake.laws.words import (
    CELL,
    EPOCH,
    HOLD,
    KIND,
    PHASE,
    REST,
    STAMP,
    WORD_SIZE,
    Schedule,
    first_words,
)
from coop_drake.scenario import Deployment
from coop_drake.scenario import Hold as HoldSettings
from coop_drake.systems import Radio, WordPlanner
from coop_drake.tree.arrays import FloatArray

_LONGEST_STOP = 0.3
"""Longest way in phase of a stop of drives [s]: about that of the motion's own."""


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

    Drives that brake bring the robot to where a stop of the motion that begins now would end. It says that it
    rests there. Once it does, and no farther from there than its monitor allows, the team may go on, and the
    supervisor starts it again. One that was started again during a run takes over the epoch, the cell and the
    phase of those who rest.

    Args:
        knowledge: This and the others are those of ``RobotNode``.
    """

    def __init__(self, knowledge: RobotKnowledge, deployment: Deployment, robot: int, name: str) -> None:
        assert knowledge.schedule is not None  # as of every robot of such a team
        assert knowledge.radio is not None
        self._ear, self._schedule = _Ear(knowledge.schedule, knowledge.radio), knowledge.schedule
        self._robot, self._rests, self._goes_on = robot, False, False
        super().__init__(knowledge, deployment, robot, name)
        self._block = self._controller.GetSubsystemByName("robot_words")
        self._columns = [2, *range(3 + knowledge.joints.start, 3 + knowledge.joints.stop)]

    def _inputs(self, measured: FloatArray) -> dict[str, FloatArray]:
        own = {"robot_state": measured[: self.state_size], "object_pose": measured[self.state_size :]}
        return own | {"words": self._ear.rows.ravel()}

    def hear_from(self, sender: int, message: Any) -> None:
        """Take in what somebody says, by its index in messages."""
        self._ear.hear(sender, message)
        if not self.place.known:
            self._take_over()

    def _act(self, time: float, measured: FloatArray, *, stopped: bool) -> tuple[FloatArray, Said]:
        """Hear, decide, compute the effort, and speak."""
        if not self.place.known:
            return np.zeros(3 + self._joints), []
        self._sampled.at(time, self._inputs(measured))
        if stopped and not self._rests:
            self._rest_at(self._stop()[0])
        self._rests, there = stopped, not stopped or self._is_there(measured)
        self._sampled.update()
        context = self._block.GetMyMutableContextFromRoot(self._sampled.context)
        if self._doubted or not there:
            self._block.ask(context, at_most=not there)
        cell, entry = nodes.row_of(self._sampled, self._controller, ["current_cell"])
        self.place = msg.Place(True, int(cell), max(round(entry / self.period), 0))
        rows = self._sampled.output("said")
        brakes = self._monitored and nodes.row_of(self._sampled, self._controller, ["alarm"])[0] >= BRAKES
        self._goes_on = (stopped or (self._goes_on and rows[HOLD] == -inf)) and there and not brakes
        if not stopped:
            stands = brakes or (rows[HOLD] == -inf and not self._goes_on)
            self.state, self.rest = nodes.STANDS if stands else nodes.FOLLOWS, self._stop()[1]
        else:
            self.state = nodes.FOLLOWS if there else nodes.OUTSIDE if self._seen else nodes.STANDS
        return self._sampled.output("robot_effort"), [msg.Word(tuple(rows.tolist()))]

    def _stop(self) -> tuple[float, FloatArray]:
        """Return the phase at which a stop that begins now would end [s], and the robot's z_k there."""
        schedule, (phase, pace, _) = self._schedule, nodes.row_of(self._sampled, self._controller, ["phase"])
        i = min(int(np.searchsorted(schedule.brakes, phase)), schedule.ends.size - 1)
        way = max(float(schedule.ends[i] - schedule.brakes[i]), 0.0)
        end = min(phase + min(float(pace) * way, _LONGEST_STOP), float(schedule.ends[i]))
        return end, self._pose_at(end)

    def _pose_at(self, phase: float) -> FloatArray:
        """Return where the robot is when the team rests at a phase [s], z_k."""
        motion, half = self._plan.motion, 3 + self._joints
        mounting = self._knowledge.mounting
        assert motion is not None  # as of the plan of every such team
        assert mounting is not None
        nominal, state = np.empty((3, motion.points.shape[1])), np.zeros(self.state_size)
        motion_at(motion.points, motion.period, phase, 0.0, 0.0, nominal)
        place_on_axes(np.ascontiguousarray(nominal[:2, self._columns]), mounting, state)
        hand = motion_room(self._chain)
        write_motion(self._chain, np.concatenate([state[:half], np.zeros(half)]), hand)
        c, s, (x, y) = np.cos(nominal[0, 2]), np.sin(nominal[0, 2]), self._knowledge.p_LE
        state[0] = nominal[0, 0] + c * x - s * y - hand[-1, PX]
        state[1] = nominal[0, 1] + s * x + c * y - hand[-1, PY]
        return state[:half]

    def _rest_at(self, phase: float, like: FloatArray | None = None) -> None:
        """Say that the robot rests at a phase [s], where its drives bring it."""
        self._block.rest_at(self._block.GetMyMutableContextFromRoot(self._sampled.context), phase, like)
        self.rest, self._rests, self._seen = self._pose_at(phase), True, False
        self._still.restart()

    def _is_there(self, measured: FloatArray) -> bool:
        """Whether the robot is seen to rest where its drives shall bring it, and its monitor is quiet."""
        half = 3 + self._joints
        assert self.rest is not None
        away = measured[:half] - self.rest
        away[2] = (away[2] + pi) % tau - pi
        self._seen = self._still.sees_rest(measured[half : self.state_size])
        quiet = not self._monitored or nodes.row_of(self._sampled, self._controller, ["alarm"])[0] == QUIET
        return self._seen and quiet and bool(np.abs(away).max() <= ROOM)

    def _take_over(self) -> None:
        """Rest as the others do, once all others have said that they rest in one epoch."""
        others = np.delete(self._ear.rows[:-1, :WORD_SIZE], self._robot, axis=0)
        resting = (
            (others[:, KIND] == REST) & (others[:, STAMP] > -inf) & (others[:, EPOCH] == others[0, EPOCH])
        )
        if len(others) and resting.all():
            like = others[np.argmin(others[:, PHASE])]
            self.place, self.state = msg.Place(True, int(like[CELL]), 0), nodes.STANDS
            self._rest_at(float(like[PHASE]), like)


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
