"""What the exact checker says of altered answers, beside the truth that is decided here."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from zlib import crc32

import numpy as np

from benchmarks.adversaries.alterations import Alteration, copied
from benchmarks.adversaries.collisions import Document
from benchmarks.adversaries.forgeries import forged_proof
from benchmarks.adversaries.plan_truth import plan_fault
from benchmarks.adversaries.plans import PLAN_ALTERATIONS
from benchmarks.adversaries.proof_truth import proof_fault
from benchmarks.adversaries.proofs import PROOF_ALTERATIONS
from coop_drake.answers import Found, Infeasible, PlanningProblem, save_plan
from coop_drake.answers.document import content_digest
from coop_drake.answers.proof import save_proof
from coop_drake.checking import RefusedError, check
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan
from coop_drake.verification.question import question_of


@dataclass(frozen=True)
class Judged:
    """An altered answer.

    Attributes:
        answer: The kind of answer, as ``kind_of`` names it.
        kind: What was altered.
        truth: ``true`` if all of it follows from a sound answer; ``false: ...`` with a statement that is
            surely false; or ``open``.
        refusal: Why the checker refuses it, empty if it accepts.
    """

    answer: str
    kind: str
    truth: str
    refusal: str

    @property
    def wrong(self) -> bool:
        """Whether a false answer is accepted, or a true one is refused."""
        return (self.truth.startswith("false") and not self.refusal) or (
            self.truth == "true" and bool(self.refusal)
        )


def kind_of(answer: Document) -> str:
    """The kind of an answer: a plan, or that of a proof; slices with joints are a kind of their own."""
    kind: str = answer.get("kind", "plan")
    joints = {tuple(part["lower"][1:]) for part in answer.get("slices", ())}
    return "slices with joints" if kind == "slices" and len(joints) > 1 else kind


def answered(problem: PlanningProblem) -> tuple[Document, Document] | None:
    """A question and its answer, plan or proof, as documents; None if the planner leaves it undecided."""
    found = plan(problem, ScheduledGains(), gain_set_name="scheduled")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "answer.json"
        if isinstance(found, Found):
            save_plan(found.plan, path)
        elif isinstance(found, Infeasible) and found.proof is not None:
            save_proof(found.proof, problem, path)
        else:
            return None
        return question_of(problem), json.loads(path.read_text(encoding="utf-8"))


def judged(question: Document, answer: Document, rounds: Iterable[int]) -> Iterator[Judged]:
    """Alter an answer in every kind of way, once for each round; judge what comes of it."""
    kinds: Mapping[str, Alteration] = PROOF_ALTERATIONS if "kind" in answer else PLAN_ALTERATIONS
    fault = proof_fault if "kind" in answer else plan_fault
    for seed in rounds:
        for kind, alteration in kinds.items():
            asked, altered = copied(question), copied(answer)
            change = alteration(asked, altered, np.random.default_rng([seed, crc32(kind.encode())]))
            if change is not None:
                altered["digest"] = content_digest(altered)
                wrong = fault(asked, altered, change.cells, seed)
                truth = f"false: {wrong}" if wrong else "true" if change.true else "open"
                yield Judged(kind_of(answer), kind, truth, refusal(asked, altered))


def forged(question: Document, rounds: Iterable[int]) -> Iterator[Judged]:
    """Forge proofs that a question with a way has none, once for each round; judge them."""
    for seed in rounds:
        proof = forged_proof(question, seed)
        if proof is not None:
            yield Judged("forged cut", "forged cut", "false: a way exists", refusal(question, proof))


def judged_source(ask: Callable[[], PlanningProblem | None], rounds: int) -> list[Judged]:
    """Answer a question and judge alterations of its answer; where there is a plan, forged proofs, too.

    Args:
        ask: Makes the question.
        rounds: How many times each kind of alteration is applied.
    """
    problem = ask()
    documents = None if problem is None else answered(problem)
    if documents is None:
        return []
    found = list(judged(*documents, range(rounds)))
    return found if "kind" in documents[1] else [*found, *forged(documents[0], range(4 * rounds))]


def refusal(question: Document, answer: Document) -> str:
    """Why the exact checker refuses an answer, empty if it accepts it."""
    try:
        check(question, answer)
    except RefusedError as refused:
        return str(refused)
    return ""
