"""Verify an answer: geometry by the exact checker, match of files and question, gains, limits and budget."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import remainder, tau
from pathlib import Path
from typing import Any

import numpy as np

from coop_drake.answers import plan as plan_file
from coop_drake.answers import proof as proof_file
from coop_drake.answers.document import Document, content_digest, problem_digest
from coop_drake.answers.plan import Plan, plan_document, same_goal_joints
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof, proof_document
from coop_drake.checking import RefusedError, check
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet
from coop_drake.progress import Progress
from coop_drake.verification.budget import check_departures
from coop_drake.verification.budget_origin import ScenarioBudgets, check_origin
from coop_drake.verification.checks import Check, Verified
from coop_drake.verification.gains import check_accelerations, check_gains, check_limits, check_speeds
from coop_drake.verification.motion import check_motion
from coop_drake.verification.question import question_of

SAME_ANGLE = 1e-9
"""Two angles that differ by this, whole turns aside, are one angle that was rounded [rad]."""


def same_angle(first: float, second: float) -> bool:
    """Whether two angles are the same up to whole turns and rounding [rad]."""
    return abs(remainder(float(first - second), tau)) <= SAME_ANGLE


def check_digest(digest: str, problem: PlanningProblem) -> None:
    """Refuse a document that was written for another floor, team, start or goal.

    Raises:
        RefusalError: Names both digests.
    """
    expected = problem_digest(problem)
    if digest != expected:
        raise RefusalError("problem", f"{digest!r} is not the scenario's digest, '{expected}'")


def check_problem(plan: Plan, problem: PlanningProblem) -> Check:
    """Compare a plan's own statement of its problem with the problem.

    Raises:
        RefusalError: Names the entry and both values.
    """
    goal, stated = problem.goal_pose, plan.goal_pose
    names = [joint.name for joint in problem.tree.joints]
    same_goal = np.array_equal(stated[:2], goal[:2]) and same_angle(stated[2], goal[2])
    for where, same, found, expected in (
        ("joint_names", list(plan.joint_names) == names, list(plan.joint_names), names),
        ("start", np.array_equal(plan.start, problem.start), plan.start.tolist(), problem.start.tolist()),
        (
            "goal_joints",
            same_goal_joints(plan, problem),
            list(plan.goal_joints),
            list(problem.goal_joints),
        ),
        ("goal_pose", same_goal, stated.tolist(), goal.tolist()),
    ):
        if not same:
            raise RefusalError(where, f"{found} is not the scenario's, {expected}")
    check_digest(plan.problem, problem)
    return Check("the problem is the scenario's: floor, team, start, goal, tolerances", 1)


def verify_plan(
    plan: Plan,
    problem: PlanningProblem,
    gain_sets: Mapping[str, GainSet],
    progress: Progress | None = None,
    *,
    budgets: ScenarioBudgets | None = None,
) -> Verified:
    """Check everything that a plan states.

    A way, a plan that limits refuse, is no answer to the question: other ways may keep the limits.

    Args:
        plan: The plan.
        problem: The problem that it should solve.
        gain_sets: The scenario's gain sets by name.
        progress: Called with a phase and the fraction of it that is done.
        budgets: What the scenario says about budgets; None for a problem without a scenario.

    Raises:
        RefusalError: Names the first statement that does not hold.
    """
    same = check_problem(plan, problem)
    exact = _exactly(problem, plan_document(plan), progress)
    checks = [same, *exact, check_gains(plan, gain_sets)]
    of_motion = check_motion(plan, problem, gain_sets[plan.gain_set])  # First: it checks the times.
    kept = check_limits(plan, problem, gain_sets[plan.gain_set]) + of_motion
    if plan.refused_by:
        return _verified_way(plan, (*checks, *_of_way(plan, problem), *kept))
    origin = None if plan.budget is None else Check("the budget is compared with no scenario", 0)
    if budgets is not None:
        origin = check_origin(plan.budget, budgets)
    checks += [
        further
        for further in (check_speeds(plan, problem), check_accelerations(plan, problem), *kept, origin)
        if further is not None
    ]
    checks += check_departures(plan, problem)
    whose = f", {origin.name}" if origin is not None else ""
    return Verified(
        "found",
        f"plan of {len(plan.cells)} cells{whose}",
        tuple(checks),
        f"no body touches a wall or another body in any state of the cells, {_proved_of_motion(plan)}",
        f"{_unproved_of_control(plan)}; that it takes as long as is estimated; that the robots are as in "
        "their models",
    )


def _proved_of_motion(plan: Plan) -> str:
    """What a plan's checks prove of how the cells lead from start to goal."""
    if plan.motion is None:
        return "which lead from start to goal"
    held = ""
    if plan.budget is not None:
        what = "a team" if plan.budget.axes else "the object's position of a team"
        held = (
            f"; {what} that departs by no more than the plan's budget, as docs/budget.md says, stays in them"
        )
    return (
        "in which the motion leads from start to goal; it keeps the limits of speed and acceleration, stated "
        "or by default, also while it brakes and starts again, and can stop before it leaves a cell"
        f"{held}"
    )


def _of_way(plan: Plan, problem: PlanningProblem) -> list[Check]:
    """Check what a way states about speeds; it has no budget, and limits of acceleration are left out."""
    if plan.budget is not None:
        raise RefusalError("budget", "is stated, but a way that limits refuse has none")
    for k, transition in enumerate(plan.transitions):
        if transition.gains.acceleration_limit is not None:
            where = f"transitions[{k}].gains.acceleration_limit"
            raise RefusalError(where, "is stated, but a way is made without such limits")
    found = (
        check_speeds(plan, problem),
        *check_departures(plan, problem),
    )
    return [check for check in found if check is not None]


def _verified_way(plan: Plan, checks: tuple[Check, ...]) -> Verified:
    """What is verified of a plan that limits refuse."""
    limits = " and ".join(refusal.limit for refusal in plan.refused_by)
    return Verified(
        "beyond limits",
        f"a way of {len(plan.cells)} cells, refused by {limits}",
        checks,
        "no body touches a wall or another body in any state of the cells, which lead from start to goal; "
        "this way breaks these limits",
        "that no other way keeps them: it is no answer to the question; that the robots are as in their "
        "models",
    )


def _unproved_of_control(plan: Plan) -> str:
    """What a plan's checks leave open of whether a team stays in its cells."""
    if plan.budget is None:
        left = "that a team stays in the cells (verify the log of its run"
        left += ")" if plan.motion is None else ", or plan with --budget)"
    elif plan.budget.axes:
        left = "that a team that departs by more than the plan's budget stays in the cells, or by more than "
        left += "docs/budget.md estimates"
    else:
        left = "that angles and joints stay in the cells, and a position that departs by more than the plan's"
        left += " budget"
    if plan.motion is None:
        return left
    jerk = "that jerk is within its limit at every instant (only its mean over each span is checked)"
    if plan.departures is not None and plan.departures.effort.size:
        return f"{left}; {jerk}"
    return f"{left}; that motors can give the efforts that the motion needs; {jerk}"


def verify_proof(
    proof: InfeasibilityProof, problem: PlanningProblem, progress: Progress | None = None
) -> Verified:
    """Check a proof that no plan exists.

    What cannot move from start to goal with some of the robots left out cannot do so with all of them: a
    proof may keep any of them. It is about all of the goal: its pose and joints with their tolerances.

    Args:
        proof: The proof.
        problem: The problem that it should refute.
        progress: Called with a phase and the fraction of it that is done.

    Raises:
        RefusalError: Names the first statement that does not hold.
    """
    checks = _exactly(problem, proof_document(proof, problem), progress)
    pieces = {number for part in proof.slices for witness in part.witnesses for number in witness.pieces}
    pieces |= {number for part in proof.slices for squeeze in part.squeezes for number in squeeze.pieces}
    names = [body.name for c in problem.tree.components for body in c.bodies for _ in body.shapes]
    bodies = ", ".join(dict.fromkeys(names[number] for number in sorted(pieces)))
    subject = f"there is no plan, by {len(proof.slices)} slices about {bodies}"
    return Verified(
        "infeasible",
        subject,
        checks,
        "no motion leads from the start to the goal, nor to anywhere within its tolerances",
        "that the robots are as in their models",
    )


def _silent(phase: str, share: float) -> None:
    """Show no progress."""


def _exactly(
    problem: PlanningProblem, answer: Mapping[str, Any], progress: Progress | None
) -> tuple[Check, ...]:
    """What the exact checker finds to hold; its refusal as an error of ours."""
    question = question_of(problem)
    aside = [reason for _, _, reason in question["left_aside"]]
    name = (
        f"pairs of bodies that may overlap, by the question: {aside.count('joint')} that a joint connects, "
        f"{aside.count('model')} that their model leaves aside"
    )
    try:
        checks = tuple(Check(*entry) for entry in check(question, answer, progress or _silent))
        return (*checks, Check(name, len(aside))) if aside else checks
    except RefusedError as refusal:
        where, _, finding = str(refusal).partition(": ")
        raise RefusalError(where, finding) from refusal


def verify_file(
    path: Path | str,
    problem: PlanningProblem,
    gain_sets: Mapping[str, GainSet],
    progress: Progress | None = None,
    *,
    budgets: ScenarioBudgets | None = None,
) -> Verified:
    """Verify a file that ``save_plan`` or ``save_proof`` wrote.

    Args:
        path: The file.
        problem: The problem that it should solve or refute.
        gain_sets: The scenario's gain sets by name.
        progress: Called with a phase and the fraction of it that is done.
        budgets: As ``verify_plan`` takes it.

    Returns:
        What was checked.

    Raises:
        PlanError: The file is neither a plan nor a proof: names the file, the key and what is allowed.
        RefusalError: It is one, but a statement in it does not hold: names the place.
    """
    document = Document.load(path, "a plan or a proof of infeasibility")
    form = document.check_entry("format", plan_file.FORMAT, proof_file.FORMAT)
    if form == plan_file.FORMAT:
        plan = plan_file.read_plan(document)
        unaltered = _check_unaltered(document)
        verified = verify_plan(plan, problem, gain_sets, progress, budgets=budgets)
    else:
        saved = proof_file.read_proof(document)
        unaltered = _check_unaltered(document)
        check_digest(saved.problem, problem)
        verified = verify_proof(saved.proof, problem, progress)
    return replace(verified, checks=(unaltered, *verified.checks))


def _check_unaltered(document: Document) -> Check:
    found, expected = document.content["digest"], content_digest(document.content)
    if found != expected:
        raise RefusalError("digest", f"{found!r} is not that of the content, '{expected}': it was altered")
    return Check("the file is as it was written, for this scenario", 1)
