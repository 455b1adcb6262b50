"""A team as processes: the supervisor's, how a run starts all on this machine, and the world's run."""

from __future__ import annotations

import gc
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any, NoReturn

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.budget import Budget
from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan, plan_digest
from coop_drake.apart import RESTARTS
from coop_drake.apart import messages as msg
from coop_drake.apart.faults import NO_FAULTS, Faults
from coop_drake.apart.membership import TOLERATED, Processes
from coop_drake.apart.messages import SUPERVISOR, WORLD, Goodbye, name_of
from coop_drake.apart.node import AHEAD, LOSSY_COPIES, NodeProcess, SampledDiagram
from coop_drake.apart.passing import PassingRobot, PassingSupervisor
from coop_drake.apart.robot import RobotNode, RobotProcess, certified_age
from coop_drake.apart.team_files import AddressBook, KeyPair, local_book
from coop_drake.apart.transport import Ends, Network
from coop_drake.apart.world import Pacing, SampleExchange
from coop_drake.diagram import brakes_of, build_world, control_period
from coop_drake.diagram.closed_loop import add_supervisor, build_station
from coop_drake.diagram.deployment import radio_of
from coop_drake.diagram.robot_controller import hold_of, robot_knowledge, team_schedule
from coop_drake.errors import CoopDrakeError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.interrupts import uninterrupted
from coop_drake.laws.measurements import period_of, whole_periods
from coop_drake.plant import build_team_plant
from coop_drake.plant.facts import scenario_digest
from coop_drake.progress import Progress
from coop_drake.scenario import Deployment, Scenario
from coop_drake.scenario import Hold as HoldSettings
from coop_drake.simulation import Sample, run_loop
from coop_drake.systems import CellPlanner
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import whole_turns

# The supervisor: cell planner and hold supervisor, computed at samples that the world gives, and its process.


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


# What each process runs, and how a run starts all on this machine.


ARRIVED, FAILED, INTERRUPTED = range(3)
"""Outcomes, see ``messages.Goodbye``."""

_CONTEXT = get_context("fork") if sys.platform == "linux" else get_context("spawn")
"""A copy has imported already what this process has; libraries of macOS may not be used in one."""

_OPENING = 30.0
"""How long processes wait for each other at the start [s]: a slow machine imports Drake for some seconds."""


def network_of(
    scenario: Scenario,
    plan: Plan,
    book: AddressBook | None = None,
    keys: KeyPair | None = None,
    faults: Faults = NO_FAULTS,
) -> Network:
    """Return what a process needs to speak with the team of a scenario and a plan.

    Args:
        scenario: The scenario.
        plan: The plan that all have.
        book: Who listens where; free ports of this machine by default.
        keys: The process' own keys, None where the book has none.
        faults: What goes wrong with messages that it sends, and with the robots' clocks.

    Raises:
        ScenarioError: Robots do not compute at common samples.
    """
    period, known = control_period(scenario), book or local_book(robots_of(scenario))
    passes = plan.motion is not None
    return Network(known, scenario_digest(scenario), plan_digest(plan), keys, faults, period, passes)


def robots_of(scenario: Scenario) -> int:
    """Return the number of robots of a scenario."""
    return len(build_team_plant(scenario, DiagramBuilder()).robots)


def run_node(
    scenario: Scenario,
    plan: Plan,
    maps: Sequence[HarmonicMap],
    index: int,
    network: Network,
    *,
    wanted: Callable[[], bool] = lambda: True,
) -> int:
    """Be one robot or the supervisor until the world says goodbye; return the outcome that it names.

    Args:
        scenario: The scenario.
        plan: The plan that all have.
        maps: The harmonic map of every transition, which the supervisor does not need.
        index: Index of the process in messages.
        network: What it needs to speak with its team.
        wanted: Says whether the process shall go on; asked while nothing comes.

    Raises:
        MessagingError: The others cannot be reached, or fall silent.
    """
    node: RobotNode | SupervisorNode | PassingSupervisor
    robots = len(network.book.robots)
    if index == SUPERVISOR:
        node = _supervisor(scenario, plan, robots, network.period)
    else:
        team = build_station(scenario).team
        known = robot_knowledge(scenario, plan, maps, team)[index]
        robot = RobotNode if known.schedule is None else PassingRobot
        node = robot(known, scenario.deployment, index, team.robots[index].name)
    ends = Ends(network, index)
    try:
        ends.open(_OPENING)
        process: NodeProcess = (
            RobotProcess(node, ends, robots)
            if isinstance(node, RobotNode)
            else SupervisorProcess(node, ends, robots)
        )
        return process.run(wanted)
    finally:
        ends.close()
        node.release()


def _supervisor(
    scenario: Scenario, plan: Plan, robots: int, period: float
) -> SupervisorNode | PassingSupervisor:
    """Return the supervisor of a team of N robots."""
    schedule = team_schedule(scenario, plan)
    if schedule is None:
        return SupervisorNode(robots, len(plan.cells), period, hold_of(scenario, plan))
    names = [robot.name for robot in build_team_plant(scenario, DiagramBuilder()).robots]
    return PassingSupervisor(schedule, radio_of(scenario.deployment, names, robots), scenario.control.hold)


class _FreshProcess(subprocess.Popen[bytes]):
    """Calls a function in a new interpreter, with the interface of the processes of ``multiprocessing``.

    A copy of a process that simulates would have its sockets, too. What ``multiprocessing`` starts anew
    imports the main module of the program again, which for a script without a guard would run it again.

    Args:
        work: The function; it and its arguments are pickled.
        arguments: Its arguments.
    """

    def __init__(self, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        begin = "import pickle, sys; work, arguments = pickle.load(sys.stdin.buffer); work(*arguments)"
        path = os.pathsep.join(folder for folder in sys.path if folder)
        command, env = [sys.executable, "-c", begin], {**os.environ, "PYTHONPATH": path}
        super().__init__(command, stdin=subprocess.PIPE, env=env)
        assert self.stdin is not None
        with self.stdin as pipe:
            pickle.dump((work, arguments), pipe)

    @property
    def exitcode(self) -> int | None:
        """Its exit code, None while it runs."""
        return self.poll()

    def join(self, timeout: float | None = None) -> None:
        """Wait for its end, at most for a time [s]."""
        with suppress(subprocess.TimeoutExpired):
            self.wait(timeout)


class LocalTeam(Processes):
    """The processes of all robots and of their supervisor, copies of this one; they end with the block.

    They have sessions of their own, so that Ctrl-C reaches only the command, which ends them.

    Args:
        scenario: The scenario.
        plan: The plan.
        maps: The harmonic map of every transition.
        network: What they need to speak with each other.
        restarts: How often ``revive`` starts each of them again.
    """

    def __init__(
        self,
        scenario: Scenario,
        plan: Plan,
        maps: Sequence[HarmonicMap],
        network: Network,
        *,
        restarts: int = 0,
    ) -> None:
        self._problem, self._network = (scenario, plan, maps), network
        self.processes = dict[int, BaseProcess | _FreshProcess]()
        self._left = dict.fromkeys((SUPERVISOR, *range(len(network.book.robots))), restarts)

    def __enter__(self) -> LocalTeam:
        for index in self._left:
            process = _CONTEXT.Process(target=_serve, args=self._given(index), daemon=True)
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
            self.processes[index] = _FreshProcess(_serve, self._given(index))
        return True

    def gone(self) -> set[int]:
        """Return the indices of the processes that have ended."""
        return {index for index, process in self.processes.items() if process.exitcode is not None}

    def _given(self, index: int) -> tuple[Any, ...]:
        """Return the arguments of a process' work."""
        return (*self._problem, index, self._network), os.getpid()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self.processes.values():
            process.join(1.0 if kind is None else 0.0)
            if process.exitcode is None:
                process.kill()
                process.join()


def _serve(arguments: tuple[Any, ...], parent: int) -> NoReturn:
    """Do the work of a process until its parent is gone."""
    os.setsid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        run_node(*arguments, wanted=lambda: os.getppid() == parent)
    except CoopDrakeError as error:
        sys.stderr.write(f"{name_of(arguments[3])}: {error}\n")
        sys.stderr.flush()
        os._exit(1)
    os._exit(0)


def run_world(
    scenario: Scenario,
    plan: Plan,
    network: Network,
    *,
    opening: float = 60.0,
    progress: Progress | None = None,
    observer: Callable[[Sample], None] | None = None,
    **options: Any,
) -> SimulationLog:
    """Wait for all robots and the supervisor, simulate the transport, and say goodbye to all.

    Args:
        scenario: The scenario.
        plan: The plan that all have.
        network: What the world needs to speak with the team.
        opening: How long to wait for the others [s].
        progress: Called with the stage and the fraction done, if given.
        observer: Called with every accepted step.
        options: As for ``SampleExchange``: ``processes``, ``pacing``, ``patience``, ``rejoin``, ``before``,
            ``report`` and ``tell``.

    Raises:
        MessagingError: Somebody is missing at the start.
    """
    ends, outcome = Ends(network, WORLD), INTERRUPTED
    options["tolerated"] = tolerated_age(scenario.deployment, plan.budget)
    options["oldest"] = certified_age(plan.budget) + TOLERATED
    exchange = SampleExchange(ends, network, len(plan.cells), **options)
    world = build_world(scenario, plan, exchange)
    exchange.brakes = brakes_of(scenario, world.team)
    gc.freeze()  # To collect garbage among all that was imported takes a tenth of a second.
    try:
        ends.open(opening, exchange.membership.gone)
        log = run_loop(world, scenario, progress=progress, observer=observer)
        exchange.report(exchange.facts())
        outcome = ARRIVED if log.reached and not log.violation else FAILED
        return log
    finally:
        for index in ends.present():
            ends.send(index, Goodbye(outcome))
        ends.close()
        world.release()
        gc.unfreeze()


def simulate_in_processes(
    scenario: Scenario,
    plan: Plan,
    maps: Sequence[HarmonicMap],
    *,
    restarts: int = RESTARTS,
    faults: Faults = NO_FAULTS,
    **options: Any,
) -> SimulationLog:
    """Start all robots and the supervisor as processes on this machine, and be the world for them.

    Args:
        scenario: The scenario.
        plan: A plan for it.
        maps: The harmonic map of every transition.
        restarts: How often each of them is started again where it ends before the run is over.
        faults: What goes wrong between the processes.
        options: As for :func:`run_world`.

    Raises:
        MessagingError: A process ended before the start.
        ScenarioError: Robots do not compute at common samples.
    """
    network = network_of(scenario, plan, faults=faults)
    with LocalTeam(scenario, plan, maps, network, restarts=restarts) as team:
        return run_world(scenario, plan, network, processes=team, **options)


def wall_clock(scenario: Scenario) -> Pacing:
    """Return the pace of the wall clock for a scenario.

    Commands may be as old as measurements are when robots use them, for which the plan's budget holds; where
    these have no delay, one control period old.
    """
    return Pacing(max(scenario.deployment.whole_delay, control_period(scenario)))


def tolerated_age(deployment: Deployment, budget: Budget | None) -> float:
    """Return how long drives hold the last effort of a robot that gives no other, before all brake [s].

    Under a budget this is what its delay leaves beside that of measurements: a plan promises nothing where
    efforts rest on older ones.
    """
    return TOLERATED if budget is None else max(0.0, budget.delay - deployment.whole_delay)
