"""Search for a path with other planners: compiled random trees, then OMPL where it is installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import nan

from benchmarks.questions.ompl_peer import has_ompl, run_ompl
from benchmarks.questions.path_check import fault_of
from benchmarks.questions.peer import PeerRun
from benchmarks.questions.trees_peer import run_trees
from coop_drake.answers import PlanningProblem
from coop_drake.tree.pose import FloatArray

_CHECKS = 50_000
"""Configurations that one run of the trees may check, about 0.2 s: most paths are found at once, and trees
that went wrong are given up."""


@dataclass(frozen=True)
class Searched:
    """What other planners found.

    Attributes:
        planners: Those that searched, in this order; the last one found the path if there is one.
        path: A path that stands the dense check, shape (m, 3 + n); None if none was found.
        seconds: CPU time that they took together; NaN if none searched [s].
    """

    planners: tuple[str, ...] = ()
    path: FloatArray | None = None
    seconds: float = nan


def search_by_peers(problem: PlanningProblem, seconds: float, seed: int) -> Searched:
    """Let each other planner search for a path, until one finds one.

    Args:
        problem: The question.
        seconds: CPU time of all planners together, of which each has the same part [s].
        seed: A positive seed.
    """
    planners: list[str] = []
    spent = 0.0
    searches: list[tuple[str, Callable[..., Iterator[PeerRun]]]] = [("trees", _trees)]
    if has_ompl():
        searches.append(("OMPL", _ompl))
    seconds /= len(searches)
    for name, search in searches:
        planners.append(name)
        own = 0.0
        for run in search(problem, seconds, seed):
            own += run.cpu_seconds
            if run.found and not fault_of(problem, run.path):
                return Searched(tuple(planners), run.path, spent + own)
            if own >= seconds or not run.checks:
                break
        spent += own
    return Searched(tuple(planners), None, spent)


def _trees(problem: PlanningProblem, seconds: float, seed: int) -> Iterator[PeerRun]:
    while True:
        yield from run_trees(problem, (seed,), _CHECKS)
        seed += 1


def _ompl(problem: PlanningProblem, seconds: float, seed: int) -> Iterator[PeerRun]:
    yield from run_ompl(problem, (seed,), seconds)
