"""Processes of a team on this machine, which begin and end with a run."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Sequence
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any, NoReturn

from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.plan import Plan
from coop_drake.answers.plan_file import plan_digest
from coop_drake.diagram import control_period
from coop_drake.diagram.knowledge import hold_of, robot_knowledge
from coop_drake.diagram.station import build_station
from coop_drake.errors import CoopDrakeError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.interrupts import uninterrupted
from coop_drake.messages import (
    SUPERVISOR,
    AddressBook,
    KeyPair,
    Question,
    RobotEnd,
    SupervisorEnd,
    name_of,
)
from coop_drake.messages.faults import NO_FAULTS, Faults
from coop_drake.messages.outgoing import Links
from coop_drake.nodes.fresh_process import FreshProcess
from coop_drake.nodes.robot_node import RobotNode
from coop_drake.nodes.robot_server import RobotServer
from coop_drake.nodes.supervisor_node import SupervisorNode
from coop_drake.nodes.supervisor_server import SupervisorServer
from coop_drake.plant import build_team_plant
from coop_drake.plant.scenario_digest import scenario_digest
from coop_drake.scenario import Scenario

_CONTEXT = get_context("fork") if sys.platform == "linux" else get_context("spawn")
"""A copy has imported already what this process has; libraries of macOS may not be used in one."""

_OPENING = 30.0
"""How long processes wait for each other at the start [s]: a slow machine imports Drake for some seconds."""


def question_of(scenario: Scenario, plan: Plan) -> Question:
    """Return what all processes of a team must agree on."""
    return Question(int(scenario_digest(scenario)[:16], 16), int(plan_digest(plan)[:16], 16))


def robots_of(scenario: Scenario) -> int:
    """Return the number of robots of a scenario."""
    return len(build_team_plant(scenario, DiagramBuilder()).robots)


def run_robot(
    scenario: Scenario,
    plan: Plan,
    maps: Sequence[HarmonicMap],
    robot: int,
    book: AddressBook,
    *,
    keys: KeyPair | None = None,
    faults: Faults = NO_FAULTS,
    wanted: Callable[[], bool] = lambda: True,
) -> int:
    """Be one robot until the world says goodbye; return the outcome that it names.

    Raises:
        MessagingError: The others cannot be reached, or fall silent.
    """
    links = Links(faults, control_period(scenario))
    team = build_station(scenario).team
    known = robot_knowledge(scenario, plan, maps, team)[robot]
    node = RobotNode(known, scenario.deployment, robot, team.robots[robot].name)
    end = RobotEnd(book, robot, question_of(scenario, plan), keys, links)
    try:
        end.open(_OPENING)
        return RobotServer(node, end).run(wanted)
    finally:
        end.close()
        node.release()


def run_supervisor(
    scenario: Scenario,
    plan: Plan,
    book: AddressBook,
    *,
    keys: KeyPair | None = None,
    faults: Faults = NO_FAULTS,
    wanted: Callable[[], bool] = lambda: True,
    tap: Callable[[str, int, bytes], object] | None = None,
) -> int:
    """Be the supervisor until the world says goodbye; return the outcome that it names.

    Raises:
        MessagingError: The others cannot be reached, or fall silent.
    """
    period, hold = control_period(scenario), hold_of(scenario, plan)
    node = SupervisorNode(len(book.robots), len(plan.cells), period, hold)
    end = SupervisorEnd(book, question_of(scenario, plan), keys, tap, Links(faults, period))
    try:
        end.open(_OPENING)
        return SupervisorServer(node, end).run(wanted)
    finally:
        end.close()
        node.release()


class LocalTeam:
    """The processes of all robots and of their supervisor, copies of this one; they end with the block.

    They have sessions of their own, so that Ctrl-C reaches only the command, which ends them.

    Args:
        scenario: The scenario.
        plan: The plan.
        maps: The harmonic map of every transition.
        book: Who listens where.
        restarts: How often ``revive`` starts each of them again.
        faults: What goes wrong with messages that they send.
    """

    def __init__(
        self,
        scenario: Scenario,
        plan: Plan,
        maps: Sequence[HarmonicMap],
        book: AddressBook,
        *,
        restarts: int = 0,
        faults: Faults = NO_FAULTS,
    ) -> None:
        self.work: dict[int, Callable[..., int]] = {SUPERVISOR: run_supervisor}
        self._arguments: dict[int, tuple[Any, ...]] = {SUPERVISOR: (scenario, plan, book)}
        for k in range(len(book.robots)):
            self.work[k], self._arguments[k] = run_robot, (scenario, plan, maps, k, book)
        self._faults, self.processes = faults, dict[int, BaseProcess | FreshProcess]()
        self._left = dict.fromkeys(self.work, restarts)

    def __enter__(self) -> LocalTeam:
        for index in self.work:
            process = _CONTEXT.Process(target=_served, args=self._given(index), daemon=True)
            with uninterrupted():
                process.start()
            self.processes[index] = process
        return self

    def revive(self, index: int) -> bool:
        """Start a process again that has ended, unless this was done too often; return whether it was."""
        if not self._left[index]:
            return False
        self._left[index] -= 1
        with uninterrupted():
            self.processes[index] = FreshProcess(_served, self._given(index))
        return True

    def _given(self, index: int) -> tuple[Any, ...]:
        """Return the arguments of a process' work."""
        return name_of(index), self.work[index], self._arguments[index], self._faults, os.getpid()

    def gone(self) -> set[int]:
        """Return the indices of the processes that have ended."""
        return {index for index, process in self.processes.items() if process.exitcode is not None}

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self.processes.values():
            process.join(1.0 if kind is None else 0.0)
            if process.is_alive():
                process.kill()
                process.join()


def _served(
    name: str, work: Callable[..., int], arguments: tuple[Any, ...], faults: Faults, parent: int
) -> NoReturn:
    """Do the work of a process until its parent is gone."""
    os.setsid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        work(*arguments, faults=faults, wanted=lambda: os.getppid() == parent)
    except CoopDrakeError as error:
        sys.stderr.write(f"{name}: {error}\n")
        sys.stderr.flush()
        os._exit(1)
    os._exit(0)
