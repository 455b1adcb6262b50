"""Verify the files that the planner wrote: read them, compare their digests, check what they state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from coop_drake.answers import plan_file, proof_file
from coop_drake.answers.digest import content_digest
from coop_drake.answers.document import Document
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet
from coop_drake.progress import Progress
from coop_drake.verification.budgets import ScenarioBudgets
from coop_drake.verification.checks import Check, Verified
from coop_drake.verification.exact import verify_plan, verify_proof
from coop_drake.verification.problem_match import check_digest


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
