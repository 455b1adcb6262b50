"""What the exact checker says of altered answers, beside the truth that is decided here."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from zlib import crc32

import numpy as np

from benchmarks.adversaries.alterations import Alteration
from benchmarks.adversaries.collisions import Document
from benchmarks.adversaries.forgeries import forged_proof
from benchmarks.adversaries.plan_truth import plan_fault
from benchmarks.adversaries.plans import PLAN_ALTERATIONS
from benchmarks.adversaries.proof_truth import proof_fault
from benchmarks.adversaries.proofs import PROOF_ALTERATIONS
from benchmarks.adversaries.questions import random_question
from benchmarks.planner.family import corridor_problem
from benchmarks.rows import Row
from benchmarks.tasks import Rows, Task
from coop_drake.answers import Found, Infeasible, PlanningProblem, save_plan
from coop_drake.answers.proof_file import save_proof
from coop_drake.checking import RefusedError, check
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan
from coop_drake.verification.question import question_of

__all__ = ["Judged", "adversary_tasks", "answered", "forged", "judged"]

ROUNDS = 14
"""How many times each kind of alteration is applied to each answer."""

RANDOM_ANSWERS = 500
"""Random questions that are answered and checked."""

PLAN_SEEDS = range(6)
"""Random questions whose plans are altered."""

PROOF_SEEDS = range(40)
"""Random questions whose proofs are altered."""


@dataclass(frozen=True)
class Judged:
    """An altered answer.

    Attributes:
        kind: What was altered.
        truth: ``true`` if all of it follows from a sound answer; ``false: ...`` with a statement that is
            surely false; or ``open``.
        refusal: Why the checker refuses it, empty if it accepts.
    """

    kind: str
    truth: str
    refusal: str

    @property
    def wrong(self) -> bool:
        """Whether a false answer is accepted, or a true one is refused."""
        return (self.truth.startswith("false") and not self.refusal) or (
            self.truth == "true" and bool(self.refusal)
        )


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
            altered = alteration(question, answer, np.random.default_rng([seed, crc32(kind.encode())]))
            if altered is not None:
                wrong = fault(altered.question, altered.answer, altered.cells, seed)
                truth = f"false: {wrong}" if wrong else "true" if altered.true else "open"
                yield Judged(kind, truth, refusal(altered.question, altered.answer))


def forged(question: Document, rounds: Iterable[int]) -> Iterator[Judged]:
    """Forge proofs that a question with a way has none, once for each round; judge them."""
    for seed in rounds:
        proof = forged_proof(question, seed)
        if proof is not None:
            yield Judged("forged cut", "false: a way exists", refusal(question, proof))


def refusal(question: Document, answer: Document) -> str:
    """Why the exact checker refuses an answer, empty if it accepts it."""
    try:
        check(question, answer)
    except RefusedError as refused:
        return str(refused)
    return ""


def adversary_tasks() -> list[Task]:
    """Altered plans, altered proofs, and random answers."""
    return [
        Task("adversaries/plans", lambda rows: _altered_rows("plans", _plans())),
        Task("adversaries/proofs", lambda rows: _altered_rows("proofs", _proofs())),
        Task("adversaries/random", lambda rows: _random_rows()),
    ]


def _plans() -> Iterator[Judged]:
    teams = [corridor_problem(), corridor_problem(0.9), corridor_problem(1.3, 1.5, 3)]
    for problem in [*teams, corridor_problem(joints_per_arm=2), *map(random_question, PLAN_SEEDS)]:
        documents = None if problem is None else answered(problem)
        if documents is not None and "kind" not in documents[1]:
            yield from judged(*documents, range(ROUNDS))


def _proofs() -> Iterator[Judged]:
    narrow = [corridor_problem(0.77), corridor_problem(0.95, 1.5, 3), corridor_problem(0.6, joints_per_arm=2)]
    for problem in [corridor_problem(), *narrow, *map(random_question, PROOF_SEEDS)]:
        documents = None if problem is None else answered(problem)
        if documents is None:
            continue
        question, answer = documents
        if "kind" in answer:
            yield from judged(question, answer, range(ROUNDS))
        else:
            yield from forged(question, range(ROUNDS))


def _altered_rows(topic: str, answers: Iterator[Judged]) -> Rows:
    """How many altered answers of each kind are false, true or open, and what the checker says of them."""
    counts: Counter[tuple[str, str]] = Counter()
    for one in answers:
        for kind in (one.kind, "all"):
            truth = one.truth.split(":")[0]
            counts[kind, "altered"] += 1
            counts[kind, truth] += 1
            counts[kind, f"{truth}, {'refused' if one.refusal else 'accepted'}"] += 1
    figures = (
        "altered",
        "false",
        "false, accepted",
        "true",
        "true, refused",
        "open, accepted",
        "open, refused",
    )
    kinds = dict.fromkeys(kind for kind, _ in counts)
    return [
        Row(f"adversaries/{topic}/{kind}/{figure}", counts[kind, figure], "answers")
        for kind in kinds
        for figure in figures
    ]


def _random_rows() -> Rows:
    """Answers to random questions: how many of each kind, refused ones, and CPU time of checking."""
    seconds: dict[str, list[float]] = {}
    refused = 0
    for problem in filter(None, map(random_question, range(RANDOM_ANSWERS))):
        documents = answered(problem)
        began = process_time()
        refused += documents is not None and bool(refusal(*documents))
        kind = "undecided" if documents is None else documents[1].get("kind", "plan")
        seconds.setdefault(kind, []).append(process_time() - began)
    rows = [Row("adversaries/random/all/refused", refused, "answers")]
    for kind, spent in sorted(seconds.items()):
        name = partial("adversaries/random/{}/{}".format, kind)
        rows.append(Row(name("answers"), len(spent), "answers"))
        if kind != "undecided":
            rows += [Row(name("median"), float(np.median(spent)), "s"), Row(name("longest"), max(spent), "s")]
    return rows
