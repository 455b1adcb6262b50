"""The world as a process: it simulates a team whose robots and supervisor are elsewhere."""

from __future__ import annotations

import gc
import time as clocks
from collections.abc import Callable, Collection, Sequence
from typing import Any

from coop_drake.answers.budget import Budget
from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.diagram import brakes_of, build_world, control_period
from coop_drake.errors import MessagingError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.messages import AddressBook, Goodbye, KeyPair, WorldEnd, local_book, name_of
from coop_drake.messages.faults import NO_FAULTS, Faults
from coop_drake.messages.outgoing import Links
from coop_drake.nodes.membership import TOLERATED
from coop_drake.nodes.pacing import Pacing
from coop_drake.nodes.processes import LocalTeam, question_of, robots_of
from coop_drake.nodes.sample_exchange import PATIENCE, SampleExchange
from coop_drake.nodes.serving import TURN
from coop_drake.nodes.stamps import certified_age
from coop_drake.nodes.states import REJOIN, RESTARTS
from coop_drake.progress import Progress
from coop_drake.scenario import Deployment, Scenario
from coop_drake.simulation import Sample, run_loop

ARRIVED, FAILED, INTERRUPTED = range(3)
"""Outcomes, see ``messages.Goodbye``."""

_REPORTED = 0.1
"""Simulated time between two reports of facts about the processes [s]: as often as people can read them."""


def run_world(
    scenario: Scenario,
    plan: Plan,
    book: AddressBook,
    *,
    keys: KeyPair | None = None,
    faults: Faults = NO_FAULTS,
    gone: Callable[[], Collection[int]] = tuple,
    opening: float = 60.0,
    pacing: Pacing | None = None,
    patience: float = PATIENCE,
    rejoin: float = REJOIN,
    revive: Callable[[int], bool] = lambda index: False,
    tell: Callable[[str], None] = lambda words: None,
    before: Callable[[int], None] = lambda sample: None,
    report: Callable[[dict[str, Any]], None] = lambda facts: None,
    progress: Progress | None = None,
    observer: Callable[[Sample], None] | None = None,
) -> SimulationLog:
    """Wait for all robots and the supervisor, simulate the transport, and say goodbye to all.

    Args:
        scenario: The scenario.
        plan: The plan that all have.
        book: Who listens where.
        keys: The world's keys, None where the book has none.
        faults: What goes wrong with messages that it sends, and with the robots' clocks.
        gone: Returns the processes that are known to have ended.
        opening: How long to wait for the others [s].
        pacing: Keeps the pace of the wall clock, see ``SampleExchange``; as ``patience`` and ``before``.
        patience: How long a process may take for an answer in lock-step [s].
        rejoin: How long a team at rest waits for who is missing [s], by the wall clock.
        revive: Starts a process again that has ended; returns whether it did.
        tell: Is told what happens to processes.
        before: Called before every sample with its number.
        report: Called ten times in a simulated second, and at the end, with facts about the processes.
        progress: Called with the stage and the fraction done, if given.
        observer: Called with every accepted step.

    Raises:
        MessagingError: Somebody is missing.
        ScenarioError: Robots do not compute at common samples.
    """
    links = Links(faults, control_period(scenario))
    end, outcome = WorldEnd(book, question_of(scenario, plan), keys, links), INTERRUPTED
    every = max(1, round(_REPORTED / links.period))

    def begin(sample: int) -> None:
        before(sample)
        if sample % every == 0:
            report(exchange.facts())

    exchange = SampleExchange(
        end,
        len(book.robots),
        links,
        pacing=pacing,
        tolerated=tolerated_age(scenario.deployment, plan.budget),
        oldest=certified_age(plan.budget) + TOLERATED,
        gone=gone,
        patience=patience,
        rejoin=rejoin,
        revive=revive,
        before=begin,
        tell=tell,
    )
    world = build_world(scenario, plan, exchange)
    exchange.brakes = brakes_of(scenario, world.team)
    if pacing is not None:
        gc.freeze()  # To collect garbage among all that was imported takes a tenth of a second.
    try:
        _open(end, opening, gone)
        log = run_loop(world, scenario, progress=progress, observer=observer)
        report(exchange.facts())
        outcome = ARRIVED if log.reached and not log.violation else FAILED
        return log
    finally:
        for index in end.present():
            end.send(index, Goodbye(outcome))
        end.close()
        world.release()
        if pacing is not None:
            gc.unfreeze()


def _open(end: WorldEnd, limit: float, gone: Callable[[], Collection[int]]) -> None:
    """Wait for everybody.

    Raises:
        MessagingError: Somebody does not come in time, or has ended.
    """
    deadline = clocks.monotonic() + limit
    while True:
        try:
            return end.open(min(TURN, limit))
        except MessagingError as error:
            if ended := gone():
                names = ", ".join(name_of(index) for index in sorted(ended))
                raise MessagingError(f"the process of {names} ended before the start") from error
            if clocks.monotonic() > deadline:
                raise MessagingError(f"{error}, {limit:g} s in all") from error


def simulate_world(
    scenario: Scenario, plan: Plan, _maps: Sequence[HarmonicMap], **options: Any
) -> SimulationLog:
    """Run the world as :func:`run_world` does, which needs no maps; called as other simulations are."""
    return run_world(scenario, plan, **options)


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
    control_period(scenario)
    book = local_book(robots_of(scenario))
    with LocalTeam(scenario, plan, maps, book, restarts=restarts, faults=faults) as team:
        return run_world(scenario, plan, book, faults=faults, gone=team.gone, revive=team.revive, **options)


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
