"""What each stage that makes plans quicker is worth: plans with one stage switched off at a time.

A stage is switched off in the process that measures it, by replacing the function or the constant that makes
it work. Each variant is compared with ``everything``: estimated transport time, margin and planning time.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from math import inf
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.isolated import in_own_process
from benchmarks.planner.family import first_question
from benchmarks.planner.ours import Planned, plan_repeatedly
from benchmarks.rows import Row
from benchmarks.smooth import QUICKEST, limited_scenario
from benchmarks.tasks import Task
from coop_drake.answers import Plan, PlanningProblem
from coop_drake.answers.motion import WAITING, Motion, TeamGains
from coop_drake.errors import PlanError
from coop_drake.planning import cell_selection, motion, sampled_search
from coop_drake.planning.cell_selection import Waypoints, choose_boxes
from coop_drake.planning.motion_limits import team_chains
from coop_drake.planning.sampling import band
from coop_drake.planning.sampling.band import smoothed
from coop_drake.planning.transitions import make_plan
from coop_drake.plant import planning_problem
from coop_drake.tree.arrays import FloatArray, IntArray

REPEATS = 2
"""Plans of every variant; the shortest planning time counts, for the machine is never idle."""

PATIENCE = 10.0
"""A variant that took longer is not repeated [CPU s]."""


@dataclass(frozen=True)
class Replacement:
    """What stands in for a part of the planner.

    Attributes:
        module: The module whose name is replaced.
        name: The name.
        value: What replaces it.
    """

    module: Any
    name: str
    value: Any


def _known_path(problem: PlanningProblem, hierarchy: object, known: Any, share: float) -> Any:
    """Smooth the known path only, as it is smoothed before candidates are compared."""
    moves = band.COMPARED_MOVES
    return smoothed(problem, known, band.LEAST_CLEARANCE, 0.0, band.BODY_GAP, moves=moves)


def _few_wide_boxes(among: Waypoints) -> IntArray:
    """Choose boxes by their number and padding: the times at which waypoints are reached count as zero."""
    return choose_boxes(among._replace(places=0.0 * among.places))


def _aimless_plan(*given: Any, targets: object, **others: Any) -> Plan:
    """Make a plan whose boxes are left in the middle of their overlaps, not at targets."""
    return make_plan(*given, **others)


def _motion_along_paths(
    plan: Plan, problem: PlanningProblem, limits: FloatArray, gains: TeamGains, room: FloatArray | None
) -> Motion:
    """Return a motion with the times of the first phase if the way is not moved in it, only its times are."""
    chains, cells, table = team_chains(problem), motion.cell_sets(plan, room), motion.LIMIT_SHARE * limits
    free, ways = np.where([True, True, False], table, inf), motion.first_ways(plan)
    for finer in range(motion.FINER + 1):
        points = motion.first_points(ways, cells, chains, table, motion.OVERLAP_SPANS * 2**finer)
        with suppress(PlanError):
            program = motion._Program(
                cells, chains, free, WAITING, motion.BRAKE_RAMP, points, motion.EVENNESS, parts=1
            )
            break
    program.held.reshape(points.shape)[:, :-1] = True
    program.solve(motion.WEIGHTS[0])
    made = motion.uniform_points(program.points, motion.PERIOD)
    windows = np.interp(program.windows, np.arange(len(points) - 2.0), program.points[1:-1, -1])
    period, rates = float(made[2, -1] - made[1, -1]), program.kappa
    return Motion(made[:, :-1], period, windows, rates, WAITING, motion.BRAKE_RAMP, 1.0, gains)


STAGES: dict[str, tuple[Replacement, ...]] = {
    "everything": (),
    "no_candidates": (Replacement(sampled_search, "best_candidate", _known_path),),
    "no_widening": (Replacement(band, "WIDE_MOVES", 0),),
    "no_straightening": (Replacement(band, "STRAIGHTENINGS", ()),),
    "no_improved_path": (
        Replacement(sampled_search, "moved_from_obstacles", lambda problem, path, share: path),
    ),
    "no_covering": (Replacement(cell_selection, "cover_path", lambda *asked: None),),
    "no_times_of_boxes": (Replacement(cell_selection, "choose_boxes", _few_wide_boxes),),
    "no_targets": (Replacement(cell_selection, "make_plan", _aimless_plan),),
    "no_moved_way": (Replacement(motion, "quickest_motion", _motion_along_paths),),
}
"""For every variant what is replaced; the name says which stage is missing."""


def stage_tasks(limit: float) -> list[Task]:
    """One task for every case.

    Args:
        limit: CPU time of all variants of a case together [s].
    """
    return [_task(name, limit) for name in QUICKEST]


def _task(name: str, limit: float) -> Task:
    def measure(rows: Sequence[Row]) -> Sequence[Row]:
        return stage_rows(f"smooth/stages/{name}", planning_problem(limited_scenario(name)), limit)

    return Task(f"smooth/stages/{name}", measure)


def stage_rows(name: str, problem: PlanningProblem, limit: float) -> list[Row]:
    """Plan with every stage switched off in turn, in one process of its own.

    Args:
        name: What the rows' names begin with.
        problem: The question.
        limit: CPU time of all variants together [s].
    """
    done = in_own_process(plan_variants, problem, limit=limit).value
    if done is None:
        return [Row(f"{name}/everything/answer", 0.0, f"none within {limit:g} CPU s")]
    rows = []
    for variant, planned in done.items():
        what = f"{name}/{variant}"
        rows.append(Row(f"{what}/answer", float(planned.answer == "found"), planned.answer))
        if planned.answer == "found":
            rows += [
                Row(f"{what}/transport", planned.transport_seconds, "s"),
                Row(f"{what}/narrowest passage", 1e3 * planned.neck_m, "mm"),
                Row(f"{what}/cells", planned.cells, "cells"),
                Row(f"{what}/cpu_seconds", planned.cpu_seconds, "s"),
            ]
    return rows


def plan_variants(problem: PlanningProblem) -> dict[str, Planned]:
    """Plan with every stage switched off in turn, after a small question has loaded the compiled kernels."""
    plan_repeatedly(first_question(), 1, PATIENCE)
    return {variant: without_stage(problem, variant) for variant in STAGES}


def without_stage(problem: PlanningProblem, variant: str) -> Planned:
    """Plan with one stage switched off; the quickest of some repetitions.

    Args:
        problem: The question.
        variant: One of ``STAGES``.
    """
    with ExitStack() as stack:
        for replaced in STAGES[variant]:
            stack.enter_context(patch.object(replaced.module, replaced.name, replaced.value))
        return min(plan_repeatedly(problem, REPEATS, PATIENCE), key=lambda planned: planned.cpu_seconds)
