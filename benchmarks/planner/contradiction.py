"""Whether another planner finds a path where ours has proved that none exists.

The other planners get far more time than in the comparison. Sampling proves nothing, but a single path would
refute a proof, so ``contradictions`` must be 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from benchmarks.isolated import in_own_process
from benchmarks.planner.family import corridor_problem
from benchmarks.planner.ours import plan_repeatedly
from benchmarks.questions.peers import PeerRun, fault_of, has_ompl, run_compiled_ompl, run_trees
from benchmarks.rows import Row
from benchmarks.tasks import Rows, Task
from coop_drake.answers import PlanningProblem

QUESTIONS: dict[str, Callable[[], PlanningProblem]] = {
    "closed": lambda: corridor_problem(0.77),
    "three_closed": lambda: corridor_problem(0.95, 1.5, robots=3),
    "elbow_closed": lambda: corridor_problem(0.6, joints_per_arm=2),
}
"""Questions that have no answer."""

START_UP = 60.0
"""CPU time that a process may take before it searches: imports and compiling [s]."""


@dataclass(frozen=True)
class Patience:
    """Effort of the other planners.

    Attributes:
        answer: CPU time of our planner [s].
        ompl: CPU time of each of OMPL's runs [s].
        runs: How many runs of OMPL, and of the compiled trees, each with a seed of its own.
        checks: Configurations that each run of the trees may check.
        trees: CPU time after which they are stopped, for each run [s].
    """

    answer: float = 20.0
    ompl: float = 15.0
    runs: int = 1
    checks: int = 500_000
    trees: float = 40.0


def contradiction_tasks(patience: Patience | None = None) -> list[Task]:
    """One task for every question that has no answer.

    Args:
        patience: The effort.
    """
    spent = patience or Patience()
    return [_task(f"planner/no_way/{name}", ask, spent) for name, ask in QUESTIONS.items()]


def _task(name: str, ask: Callable[[], PlanningProblem], spent: Patience) -> Task:
    def measure(rows: Rows) -> Rows:
        return contradiction_rows(name, ask(), spent)

    return Task(name, measure)


def contradiction_rows(name: str, problem: PlanningProblem, spent: Patience) -> list[Row]:
    """Answer a question, then let other planners search for a path.

    A path that passes the dense check contradicts the answer "infeasible".

    Args:
        name: What the rows' names begin with.
        problem: The question.
        spent: The effort.
    """
    ours = in_own_process(plan_repeatedly, problem, 1, 0.0, limit=spent.answer).value
    answer = "none" if ours is None else ours[0].answer
    seeds = tuple(range(1, 1 + spent.runs))
    runs = _runs(run_trees, problem, seeds, spent.checks, limit=START_UP + spent.trees * len(seeds))
    if has_ompl():
        runs += _runs(run_compiled_ompl, problem, seeds, spent.ompl, limit=START_UP + spent.ompl * len(seeds))
    paths = [run.path for run in runs if run.found]
    good = sum(not fault_of(problem, path) for path in paths)
    seconds = sum(run.cpu_seconds for run in runs)
    return [
        Row(f"{name}/answer", float(answer not in ("undecided", "none")), answer),
        Row(
            f"{name}/contradictions",
            good if answer == "infeasible" else 0,
            f"paths in {len(runs)} runs, {seconds:.0f} CPU s",
        ),
        Row(f"{name}/paths_found", good, "paths"),
        Row(f"{name}/checks", sum(run.checks for run in runs), "checks"),
    ]


def _runs(peer: Callable[..., tuple[PeerRun, ...]], *arguments: Any, limit: float) -> tuple[PeerRun, ...]:
    return in_own_process(peer, *arguments, limit=limit).value or ()
