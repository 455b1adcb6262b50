"""The chain's first half, without Drake: from a question to a plan or a proof, or to a plan made before."""

from __future__ import annotations

from math import remainder, tau
from pathlib import Path

import numpy as np
from rich.markup import escape

from coop_drake.answers import (
    Found,
    Infeasible,
    Plan,
    PlanningProblem,
    PlanningResult,
    Undecided,
    load_plan,
    save_plan,
    table_1,
)
from coop_drake.answers.digest import problem_digest
from coop_drake.answers.proof_file import save_proof
from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.measures import answer_of, plan_measures, planning_measures
from coop_drake.cli.question import Question
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.summary import summary_rows
from coop_drake.errors import PlanError
from coop_drake.files import write_atomically
from coop_drake.memory import peak_memory_mb
from coop_drake.planning import reschedule
from coop_drake.planning.planner import plan
from coop_drake.planning.warm_up import main as load_kernels

__all__ = ["plan_only", "plan_question", "read_plan", "search_plan", "without_plan"]

_SAME_GOAL = 1e-9  # Rounding of whole turns of the goal's angle [m, rad].


def plan_only(question: Question, out: Path | None, reporter: Reporter) -> ExitCode:
    """Plan, and say where the plan is, or why there is none."""
    folder = ResultFolder.of(question.name, out)
    result = plan_question(question, folder, reporter)
    if not isinstance(result, Found):
        return without_plan(question, result, folder, reporter)
    reporter.table(question.name, summary_rows(reporter.facts))
    reporter.say(f"The plan is in {escape(str(folder.plan))}")
    return ExitCode.DONE


def without_plan(
    question: Question, result: Infeasible | Undecided, folder: ResultFolder | None, reporter: Reporter
) -> ExitCode:
    """Say that there is no plan, or that none is known, and where the proof is if a folder was written."""
    answer = answer_of(result)
    reporter.table(question.name, summary_rows(reporter.facts))
    reporter.say(f"[bold]{answer}[/]: {escape(result.reason)}")
    if folder is not None and folder.certificate.exists():
        reporter.say(f"The proof is in {escape(str(folder.certificate))}")
    reporter.say(f"What blocks, and what would help: coop-drake why {escape(str(question.path))}")
    return ExitCode.INFEASIBLE if isinstance(result, Infeasible) else ExitCode.UNDECIDED


def plan_question(question: Question, folder: ResultFolder, reporter: Reporter) -> PlanningResult:
    """Plan, note what it took, and write the plan, or the proof that there is none."""
    result = search_plan(question, reporter)
    folder.make()
    folder.forget_plan()
    if isinstance(result, Found):
        save_plan(result.plan, folder.plan)
        write_atomically(folder.table, table_1(result.plan).encode())
    elif isinstance(result, Infeasible) and result.proof is not None:
        save_proof(result.proof, question.problem, folder.certificate)
    return result


def search_plan(question: Question, reporter: Reporter) -> PlanningResult:
    """Plan and note what it took; nothing is written.

    Compiled parts are loaded first, on a clock of their own: what planning took does not depend on the cache.
    """
    with reporter.stage("loading"), reporter.stopwatch("loading", cpu=True):
        load_kernels()
    with reporter.stage("planning") as progress, reporter.stopwatch("planning", cpu=True):
        gain_set = question.gain_sets[question.gains]
        result = plan(question.problem, gain_set, gain_set_name=question.gains, progress=progress)
    reporter.facts.update(planning_measures(result), peak_memory_mb=peak_memory_mb())
    return result


def read_plan(question: Question, path: Path, reporter: Reporter, *, gains_given: bool) -> Plan:
    """Read a plan that was made for this scenario.

    Args:
        question: What the scenario asks.
        path: The plan file.
        reporter: Takes note of the plan's size.
        gains_given: Whether the gain set was asked for; else the plan's own gains stay.

    Raises:
        PlanError: The file is no plan, or belongs to another scenario.
    """
    found, problem = load_plan(path), question.problem
    names = tuple(joint.name for joint in problem.tree.joints)
    if found.joint_names != names:
        raise PlanError(
            f"{path}: joint_names: {_listed(found.joint_names)} is not allowed; expected the scenario's, "
            f"{_listed(names)}"
        )
    if not np.array_equal(found.start, problem.start):
        raise PlanError(
            f"{path}: start: {found.start.tolist()} is not allowed; expected the scenario's, "
            f"{problem.start.tolist()}"
        )
    _check_goal(problem, found, path)
    if found.problem != (asked := problem_digest(problem)):
        raise PlanError(
            f"{path}: problem: {found.problem!r} is not allowed; expected {asked!r}, the scenario's digest: "
            "the plan was made for another floor, team or tolerance"
        )
    if gains_given:  # Also by the same name: a file may hold other gains than those of the plan.
        found = reschedule(found, question.gain_sets[question.gains], question.gains)
    reporter.facts.update(
        answer="found", slices=0, first_plan_cpu_seconds=0.0, planning_cpu_seconds=0.0, **plan_measures(found)
    )
    return found


def _check_goal(problem: PlanningProblem, found: Plan, path: Path) -> None:
    away = found.goal_pose - problem.goal_pose
    away[2] = remainder(away[2], tau)
    if found.goal_joints != problem.goal_joints or np.abs(away).max() > _SAME_GOAL:
        raise PlanError(
            f"{path}: goal_pose: {found.goal_pose.tolist()} with goal_joints {list(found.goal_joints)} is "
            f"not allowed; expected the scenario's, {problem.goal_pose.tolist()} with "
            f"{list(problem.goal_joints)}"
        )


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "no joint"
