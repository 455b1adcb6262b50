"""The search for gains: candidates, trials by simulating the transport, and the best of them."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from math import exp, inf, isfinite, log
from pathlib import Path
from typing import Any

import numpy as np

from coop_drake.answers import Found, Plan, PlanningProblem
from coop_drake.compiled_loop import CompiledTransport, prepare, run, with_gains
from coop_drake.compiled_loop.running import check_deployment
from coop_drake.errors import ScenarioError, TuningError
from coop_drake.extras import install_advice
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.interrupts import uninterrupted
from coop_drake.laws.gains import FixedGains, GainSet
from coop_drake.planning import reschedule
from coop_drake.planning.planner import plan
from coop_drake.scenario import Scenario, load_scenario
from coop_drake.simulation import build_maps, simulate
from coop_drake.tree.arrays import FloatArray
from coop_drake.tuning.objective import CRITERIA, GainTrial, Objective, TrialOutcome, outcome_of

# Trials of gain sets: a plan is run with other gains, by the compiled loop where it knows the team.
#
# A run of the compiled loop takes a small part of the time of one of Drake's loop. A team in continuous
# time is sampled there; its forces then differ by some 2 % from those of Drake's loop, and its duration by
# 0.6 %.

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
        return GainTrial(gains, TrialOutcome(found.arrived, done, values, found.reason), "compiled")

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

    def replan(self, problem: PlanningProblem, gains: GainSet) -> TrialOutcome | None:
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


# The search for gains by the covariance matrix adaptation evolution strategy (CMA-ES).
#
# It uses the order of the scores alone, so that limits and failed runs need no tuned penalties, and it
# begins around the current gains. A generation has about a dozen runs; strategies that first sample the
# whole range of every gain need many more.

_FIRST_STEP = 0.15
"""Standard deviation of the first generation, as a fraction of every gain's logarithmic range [-]."""

TryAll = Callable[[Sequence[GainSet]], Iterable[GainTrial]]


@dataclass(frozen=True)
class Parameter:
    """A gain that the search may change.

    Attributes:
        name: Field of the gain set.
        lower: Smallest value tried, positive, in the gain's unit.
        upper: Largest value tried, in the gain's unit.
    """

    name: str
    lower: float
    upper: float

    def value(self, fraction: float) -> float:
        """Return lower^(1 - f) upper^f for a fraction f, rounded to four digits; f is clipped to [0, 1]."""
        inside = min(max(fraction, 0.0), 1.0)
        return float(f"{exp(log(self.lower) + inside * log(self.upper / self.lower)):.4g}")

    def fraction(self, value: float) -> float:
        """Return the fraction f with lower^(1 - f) upper^f = value."""
        return log(value / self.lower) / log(self.upper / self.lower)


# The ranges hold an order of magnitude or two around the defaults. Ranges of a smallest and of a largest gain
# meet and do not overlap, so that every combination is a valid gain set.
_SCHEDULED = (
    Parameter("age_phase", 0.1, 0.8),
    Parameter("position_fraction", 0.1, 1.0),
    Parameter("ramp_fraction", 0.1, 1.0),
    Parameter("wall_stiffness", 2.0, 100.0),
    Parameter("min_stiffness", 10.0, 80.0),
    Parameter("max_stiffness", 80.0, 800.0),
    Parameter("damping_factor", 0.7, 3.0),
    Parameter("governor_factor", 0.3, 3.0),
    Parameter("funnel_acceleration", 2.0, 60.0),
    Parameter("goal_acceleration", 0.1, 4.0),
    Parameter("turning_acceleration", 0.1, 4.0),
    Parameter("min_decay_rate", 0.7, 4.0),
    Parameter("decay_fraction", 0.2, 1.0),
    Parameter("max_log_gain", 0.01, 1.0),
    Parameter("log_fraction", 0.05, 1.0),
    Parameter("log_acceleration", 1.0, 60.0),
    Parameter("energy_factor", 1.05, 3.0),
    Parameter("energy_allowance", 0.05, 3.0),
    Parameter("entry_rate", 0.005, 0.1),
)
_FIXED = (
    Parameter("stiffness", 10.0, 400.0),
    Parameter("damping", 2.0, 50.0),
    Parameter("governor_gain", 1.0, 30.0),
    Parameter("angle_decay_rate", 0.7, 8.0),
    Parameter("joint_decay_rate", 0.7, 8.0),
    Parameter("log_gain", 0.01, 3.0),
    Parameter("position_gain", 0.3, 4.0),
    Parameter("rate_gain", 0.5, 30.0),
    Parameter("energy_factor", 1.05, 3.0),
    Parameter("energy_allowance", 0.05, 3.0),
)


def tunable_parameters(gain_set: GainSet, names: Sequence[str] = ()) -> tuple[Parameter, ...]:
    """Return the parameters of a gain set, their ranges widened so that they contain its gains.

    ``names`` are those of the gains that may change; all by default.

    Raises:
        TuningError: A name is no gain of this set that can be changed.
    """
    tunable = _FIXED if isinstance(gain_set, FixedGains) else _SCHEDULED
    known = {parameter.name: parameter for parameter in tunable}
    for name in names:
        if name not in known:
            raise TuningError(f"--vary {name}: expected one of {', '.join(known)}")
    chosen = [known[name] for name in dict.fromkeys(names)] if names else list(known.values())
    values = [getattr(gain_set, parameter.name) for parameter in chosen]
    return tuple(
        replace(parameter, lower=min(parameter.lower, value), upper=max(parameter.upper, value))
        for parameter, value in zip(chosen, values, strict=True)
    )


def to_fractions(gain_set: GainSet, parameters: Sequence[Parameter]) -> FloatArray:
    """Return the parameters of a gain set as fractions of their ranges, shape (len(parameters),)."""
    return np.array([parameter.fraction(getattr(gain_set, parameter.name)) for parameter in parameters])


def with_fractions(gain_set: GainSet, parameters: Sequence[Parameter], fractions: FloatArray) -> GainSet:
    """Return the gain set with other values of its parameters.

    Raises:
        ValueError: The class of the gain set refuses the gains.
    """
    values: dict[str, Any] = {
        parameter.name: parameter.value(float(fraction))
        for parameter, fraction in zip(parameters, fractions, strict=True)
    }
    return replace(gain_set, **values)


@dataclass
class Search:
    """All trials in order; the first is the run before tuning.

    Attributes:
        objective: Gives the score of a trial.
        trials: The trials.
        scores: Score of every trial.
        interrupted: Whether Ctrl-C ended the search.
    """

    objective: Objective
    trials: list[GainTrial] = field(default_factory=list)
    scores: list[float] = field(default_factory=list)
    interrupted: bool = False

    def add(self, trial: GainTrial) -> float:
        """Append a trial, and return its score."""
        self.trials.append(trial)
        self.scores.append(self.objective.score(trial.outcome))
        return self.scores[-1]

    @property
    def best(self) -> GainTrial:
        """The trial with the smallest score; the first one if several have it."""
        return self.trials[int(np.argmin(self.scores))]

    def verify(self, simulate: Callable[[GainSet], GainTrial]) -> None:
        """Simulate the best trial of the compiled loop in Drake's, until the best one is of Drake's loop."""
        while self.best.loop != "drake":
            k = int(np.argmin(self.scores))
            self.trials[k] = simulate(self.best.gains)
            self.scores[k] = self.objective.score(self.trials[k].outcome)


def search(
    before: GainTrial,
    parameters: Sequence[Parameter],
    objective: Objective,
    try_all: TryAll,
    *,
    runs: int,
    seed: int,
    progress: Callable[[str, float], None] | None = None,
) -> Search:
    """Search gains with a smaller score.

    The result depends on the seed and the number of runs, not on the number of processes: every generation is
    simulated as a whole before the next is made. Ctrl-C ends the search and keeps the trials so far.

    Args:
        before: Trial of the current gains.
        parameters: Gains that may change.
        objective: Gives the score of a trial.
        try_all: Simulates gain sets; yields their trials in the same order.
        runs: Largest number of trials, besides ``before``.
        seed: Seed of the search.
        progress: Called with the best score so far and the fraction of the runs that are done.

    Raises:
        TuningError: The package ``cma`` is not installed.
    """
    found = Search(objective)
    found.add(before)
    strategy = evolution_strategy(to_fractions(before.gains, parameters), runs, seed)
    try:
        while len(found.trials) <= runs and not strategy.stop():
            asked = strategy.ask()[: runs + 1 - len(found.trials)]
            scores = []
            for trial in try_all(
                [with_fractions(before.gains, parameters, fractions) for fractions in asked]
            ):
                scores.append(found.add(trial))
                if progress is not None:
                    progress(f"best score {min(found.scores):.3f}", (len(found.trials) - 1) / runs)
            if len(scores) == strategy.popsize:
                strategy.tell(asked, scores)
    except KeyboardInterrupt:
        found.interrupted = True
    return found


def load_optimizer() -> Any:
    """Import and return the package ``cma``, which is not installed with coop_drake itself.

    Raises:
        TuningError: It is not installed.
    """
    try:
        return import_module("cma")
    except ImportError as error:
        message = f"tuning needs the package cma, which is not installed: {install_advice('cma')}"
        raise TuningError(message) from error


def evolution_strategy(start: np.ndarray, runs: int, seed: int, *, first_step: float = _FIRST_STEP) -> Any:
    """Return a strategy for numbers between 0 and 1, ready for its first generation.

    Args:
        start: Where it begins.
        runs: Largest number of trials.
        seed: Its seed; numpy's global generator is not touched.
        first_step: Standard deviation of the first generation [-].

    Raises:
        TuningError: The package ``cma`` is not installed.
    """
    random = np.random.default_rng(seed)
    options = {
        "bounds": [0.0, 1.0],
        "seed": np.nan,  # A number would seed numpy's global generator; `randn` is used instead.
        "randn": lambda *shape: random.standard_normal(shape),
        "maxfevals": runs,
        "verbose": -9,
    }
    return load_optimizer().CMAEvolutionStrategy(start, first_step, options)
