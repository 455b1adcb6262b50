"""OMPL with a check that is compiled for the question: what a call through Python costs at the least."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numba
import numpy as np

from benchmarks.questions.ompl_peer import run_ompl
from benchmarks.questions.peer import PeerRun
from coop_drake.answers import PlanningProblem
from coop_drake.planning.sampling.collision import grid_for_team, is_free
from coop_drake.tree.team_arrays import team_arrays

__all__ = ["run_compiled_ompl"]


def run_compiled_ompl(problem: PlanningProblem, seeds: Sequence[int], budget: float) -> tuple[PeerRun, ...]:
    """Run RRT-Connect once for every seed, with the team and the floor as constants of the compiled check.

    Args:
        problem: The question.
        seeds: Positive seeds.
        budget: CPU time of each run [s].
    """
    return run_ompl(problem, seeds, budget, _compiled_check(problem))


def _compiled_check(problem: PlanningProblem) -> Callable[..., bool]:
    team = team_arrays(problem.tree)
    grid = grid_for_team(problem.workspace, team)

    @numba.njit
    def check(*values: float) -> bool:
        free: bool = is_free(team, grid, np.array(values), 0.0)
        return free

    check(*map(float, problem.start))
    compiled: Callable[..., bool] = check
    return compiled
