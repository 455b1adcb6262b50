"""A compiled RRT-Connect in the whole configuration space, without proofs: the shortest time for sampling.

It does what OMPL's does, with the same check, the same range and the same motions, but in one compiled loop:
what a sampling planner takes for a path that nobody has proved when no time is lost in Python.
"""

from __future__ import annotations

from collections.abc import Sequence
from time import process_time

import numpy as np

from benchmarks.questions.footprint import free_goals, prepared_check
from benchmarks.questions.peer import GOALS, MOTION_STEP, RANGE, PeerRun
from benchmarks.questions.tree_kernels import rrt_connect
from coop_drake.answers import PlanningProblem
from coop_drake.planning.sampling.collision import grid_for_team
from coop_drake.tree.levers import configuration_scale

__all__ = ["CHECKS", "run_trees"]

CHECKS = 300_000
"""Budget of one run, in configurations checked."""


def run_trees(problem: PlanningProblem, seeds: Sequence[int], checks: int = CHECKS) -> tuple[PeerRun, ...]:
    """Run the compiled trees once for every seed.

    Args:
        problem: The question.
        seeds: Seeds.
        checks: Configurations that each run may check.
    """
    tree = problem.tree
    team, scale, check = tree.arrays, configuration_scale(tree), prepared_check(problem)
    grid = grid_for_team(problem.workspace, team)
    x_lower, y_lower, x_upper, y_upper = problem.workspace.bounds
    lower = np.array([x_lower, y_lower, -np.pi, *tree.range_lower])
    upper = np.array([x_upper, y_upper, np.pi, *tree.range_upper])
    start = problem.start.astype(float)

    def attempt(seed: int, budget: int) -> PeerRun:
        goals = free_goals(problem, check, GOALS, seed)
        if len(goals) == 0:
            return PeerRun(seed, 0.0, goals, 0)
        random = np.random.default_rng(seed)
        begin = process_time()
        path, spent = rrt_connect(
            team, grid, start, goals, lower, upper, scale, RANGE, MOTION_STEP, random, budget
        )
        return PeerRun(seed, process_time() - begin, path, spent)

    attempt(seeds[0], 1)
    return tuple(attempt(seed, checks) for seed in seeds)
