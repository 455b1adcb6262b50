"""Worker processes for trials: runs are simulated in parallel."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from coop_drake.answers import Plan
from coop_drake.fields import HarmonicMap
from coop_drake.interrupts import uninterrupted
from coop_drake.laws import GainSet
from coop_drake.scenario import load_scenario
from coop_drake.tuning.trial import GainTrial, TrialRunner, fastest_blocks

_TRIALS_EACH = 100
"""Trials after which a process is replaced, so that memory does not grow."""

_runner: TrialRunner | None = None


class Workers:
    """Processes that simulate gain sets. As a context manager they end with the context, also after Ctrl-C.

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
        """Simulate gain sets in parallel; trials come in the order of the gain sets."""
        with uninterrupted():
            trials = [self._pool.submit(_try, gains) for gains in gain_sets]
        return (trial.result() for trial in trials)


def _prepare(scenario: Path, plan: Plan, maps: tuple[HarmonicMap, ...], longest: float) -> None:
    """Prepare a process: read the scenario and make its runner of trials."""
    global _runner
    task = load_scenario(scenario)
    _runner = TrialRunner(task, plan, maps, longest=longest, blocks=fastest_blocks(task, plan, maps))


def _try(gains: GainSet) -> GainTrial:
    assert _runner is not None
    return _runner.try_gains(gains)
