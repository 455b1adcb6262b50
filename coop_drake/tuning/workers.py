"""Trials in processes of their own, side by side: Drake's Diagrams with Python parts leak a little each."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from coop_drake.answers import Plan
from coop_drake.fields import HarmonicMap
from coop_drake.laws import GainSet
from coop_drake.scenario import load_scenario
from coop_drake.tuning.trial import Trial, Workbench, quickest_blocks

__all__ = ["Workers"]

_TRIALS_EACH = 100
"""A process is replaced after so many trials, which keeps memory flat."""

_bench: Workbench | None = None


class Workers:
    """Processes that try gain sets; as a context they end with it, also at Ctrl-C.

    Args:
        scenario: The scenario file; processes read it for themselves.
        plan: Its plan.
        maps: The plan's maps.
        longest: Runs that last longer count as failed [s].
        count: How many processes.
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
        # Shutting down alone would wait for trials that are under way; there is no public way to end them.
        # They end first, and nothing is cancelled: the pool trips over cancelled trials of dead processes.
        for process in list((self._pool._processes or {}).values()):
            process.terminate()
        self._pool.shutdown()

    def try_all(self, gain_sets: Sequence[GainSet]) -> Iterator[Trial]:
        """Try gain sets side by side; results come in their order, whichever is ready first."""
        with _interrupts_held_back():
            trials = [self._pool.submit(_try, gains) for gains in gain_sets]
        return (trial.result() for trial in trials)


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Ctrl-C waits until the processes have begun; they inherit that it is held back, and never see it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _prepare(scenario: Path, plan: Plan, maps: tuple[HarmonicMap, ...], longest: float) -> None:
    """Set a process up."""
    global _bench
    task = load_scenario(scenario)
    _bench = Workbench(task, plan, maps, longest=longest, blocks=quickest_blocks(task, plan, maps))


def _try(gains: GainSet) -> Trial:
    assert _bench is not None
    return _bench.try_gains(gains)
