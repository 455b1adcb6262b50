"""Plans and proofs as files: recognised, read, held against their digests, verified."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import shapely

from coop_drake.answers.digest import content_digest
from coop_drake.answers.document import Entry
from coop_drake.answers.plan_reader import FORMAT as PLAN_FORMAT
from coop_drake.answers.plan_reader import read_plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof_reader import FORMAT as PROOF_FORMAT
from coop_drake.answers.proof_reader import read_proof
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet
from coop_drake.verification.checks import Check, Progress, Verified
from coop_drake.verification.found import verify_plan
from coop_drake.verification.infeasible import verify_proof
from coop_drake.verification.question import same_question

__all__ = ["verify_file"]


def verify_file(
    path: Path | str,
    problem: PlanningProblem,
    gain_sets: Mapping[str, GainSet],
    progress: Progress | None = None,
) -> Verified:
    """Verify a file that ``save_plan`` or ``save_proof`` wrote.

    Args:
        path: The file.
        problem: The question that it should answer.
        gain_sets: The scenario's gain sets by name.
        progress: Called with a phase and the share of it that is done.

    Returns:
        What was checked.

    Raises:
        PlanError: The file is neither a plan nor a proof: names the file, the key and what is allowed.
        RefusalError: It is one, but something in it does not hold: names the place.
    """
    root = Entry.load(path, "a plan or a proof of infeasibility")
    known = root.value if isinstance(root.value, dict) else {}
    Entry(root.file, "format", known.get("format")).one_of(PLAN_FORMAT, PROOF_FORMAT)
    try:
        if known["format"] == PLAN_FORMAT:
            plan = read_plan(root)
            digest = _check_digest(root)
            verified = verify_plan(plan, problem, gain_sets, progress)
        else:
            saved = read_proof(root)
            digest = _check_digest(root)
            same_question(saved.problem, problem)
            verified = verify_proof(saved.proof, problem, progress)
    except shapely.errors.GEOSException as error:
        raise RefusalError("document", f"geometry in it cannot be worked with: {error}") from error
    return Verified(verified.answer, verified.subject, (digest, *verified.checks))


def _check_digest(root: Entry) -> Check:
    expected = content_digest(root.value)
    if root.value["digest"] != expected:
        raise RefusalError(
            "digest", f"{root.value['digest']!r} is not that of the content, '{expected}': it was altered"
        )
    return Check("content is what was written, for this scenario", 1)
