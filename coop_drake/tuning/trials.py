"""Trials of gain sets: a plan is run with other gains, by the compiled loop where it knows the team.

A run of the compiled loop takes a small part of the time of one of Drake's loop. A team in continuous time is
sampled there; its forces then differ by some 2 % from those of Drake's loop, and its duration by 0.6 %.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cached_property
from math import inf, isfinite
from pathlib import Path

from coop_drake.answers import Found, Plan, PlanningProblem
from coop_drake.compiled_loop import CompiledTransport, prepare, run, with_gains
from coop_drake.compiled_loop.running import check_deployment
from coop_drake.errors import ScenarioError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.interrupts import uninterrupted
from coop_drake.laws import GainSet
from coop_drake.planning import reschedule
from coop_drake.planning.planner import plan
from coop_drake.scenario import Scenario, load_scenario
from coop_drake.simulation import build_maps, simulate
from coop_drake.tuning.objective import CRITERIA, GainTrial, RunOutcome, outcome_of

_SEARCH_RATE = 500.0
"""Control rate at which the compiled loop runs a team in continuous time [Hz]: twice the highest rate of the
shipped deployments, so that gains which real teams bear are not lost for the sampling."""

_TRIALS_EACH = 100
"""Trials after which a process is replaced, so that memory does not grow."""


class TrialRunner:
    """Runs one plan with different gain sets; its cells and maps do not depend on gains.

    Args:
        scenario: The scenario.
        plan: Its plan.
        maps: The harmonic map of every transition.
        longest: Runs that last longer count as failed [s].
    """

    def __init__(
        self, scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap], *, longest: float = inf
    ) -> None:
        settings = scenario.simulator
        brief = replace(settings, max_time=min(longest, settings.max_time))
        self._scenario, self.plan, self.maps = replace(scenario, simulator=brief), plan, tuple(maps)

    def simulate(self, gains: GainSet) -> GainTrial:
        """Simulate the plan with other gains by Drake's loop."""
        log = simulate(self._scenario, reschedule(self.plan, gains, "trial"), self.maps)
        return GainTrial(gains, outcome_of(log, len(self.plan.cells)))

    def estimate(self, gains: GainSet) -> GainTrial:
        """Run the plan with other gains by the compiled loop, or by Drake's loop where it cannot."""
        if self._transport is None:
            return self.simulate(gains)
        found = run(with_gains(self._transport, reschedule(self.plan, gains, "trial"), self.maps))
        values = {name: getattr(found, name) for name in CRITERIA}
        values = {name: value if isfinite(value) else 0.0 for name, value in values.items()}  # without joints
        done = 1.0 if found.arrived else found.cell / len(self.plan.cells)
        return GainTrial(gains, RunOutcome(found.arrived, done, values, found.reason), "compiled")

    @cached_property
    def _transport(self) -> CompiledTransport | None:
        """What the compiled loop runs; None for teams that it does not know, such as those with springs."""
        scenario = self._scenario
        if scenario.deployment.period is None:
            scenario = replace(scenario, deployment=replace(scenario.deployment, control_rate=_SEARCH_RATE))
        try:
            gains = scenario.gain_sets[scenario.selected_gains]
            transport = prepare(scenario, reschedule(self.plan, gains, "trial"), self.maps)
            check_deployment(transport, scenario.deployment)
        except ScenarioError:
            return None
        return transport

    def replan(self, problem: PlanningProblem, gains: GainSet) -> RunOutcome | None:
        """Plan again with other gains, which may give other cells, and simulate; None if no plan is found."""
        result = plan(problem, gains, gain_set_name="trial")
        if not isinstance(result, Found):
            return None
        maps = build_maps(result.plan, tolerance=self._scenario.maps.tolerance)
        return outcome_of(simulate(self._scenario, result.plan, maps), len(result.plan.cells))


_runner: TrialRunner | None = None


class Workers:
    """Processes that run gain sets. As a context manager they end with the context, also after Ctrl-C.

    Args:
        scenario: The scenario file; every process reads it.
        plan: Its plan.
        maps: The plan's maps.
        longest: Runs that last longer count as failed [s].
        count: Number of processes.
    """

    def __init__(
        self, scenario: Path, plan: Plan, maps: Sequence[HarmonicMap], *, longest: float, count: int
    ) -> None:
        self._pool = ProcessPoolExecutor(
            count,
            mp_context=multiprocessing.get_context("spawn"),  # Forks of a process with threads may hang.
            initializer=_prepare,
            initargs=(scenario, plan, tuple(maps), longest),
            max_tasks_per_child=_TRIALS_EACH,
        )

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        # `shutdown` alone would wait for running trials, and there is no public way to end them. Nothing is
        # cancelled, because the pool fails on cancelled trials of processes that have ended.
        for process in list((self._pool._processes or {}).values()):
            process.terminate()
        self._pool.shutdown()

    def try_all(self, gain_sets: Sequence[GainSet]) -> Iterator[GainTrial]:
        """Run gain sets in parallel; trials come in the order of the gain sets."""
        with uninterrupted():
            trials = [self._pool.submit(_try, gains) for gains in gain_sets]
        return (trial.result() for trial in trials)


def _prepare(scenario: Path, plan: Plan, maps: tuple[HarmonicMap, ...], longest: float) -> None:
    """Prepare a process: read the scenario and make its runner of trials."""
    global _runner
    _runner = TrialRunner(load_scenario(scenario), plan, maps, longest=longest)


def _try(gains: GainSet) -> GainTrial:
    assert _runner is not None
    return _runner.estimate(gains)
