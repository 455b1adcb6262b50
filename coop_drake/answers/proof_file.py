"""The file ``certificate.json``: a proof of infeasibility, bound to the planning problem that it refutes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.document import Document, write_document
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.typed_data import to_plain

FORMAT = "coop_drake proof of infeasibility"
"""What the document says it is."""

VERSION = 4
"""Version of its layout; another one is refused."""


@dataclass(frozen=True)
class SavedProof:
    """A proof with the planning problem that it belongs to.

    Attributes:
        problem: Digest of the planning problem.
        proof: The proof.
    """

    problem: str
    proof: InfeasibilityProof


def save_proof(proof: InfeasibilityProof, problem: PlanningProblem, path: Path | str) -> Path:
    """Write a proof that a planning problem has no solution, whole or not at all; return the path."""
    return write_document(path, proof_document(proof, problem), rows=("slices",))


def proof_document(proof: InfeasibilityProof, problem: PlanningProblem) -> dict[str, Any]:
    """The content of a proof's file without its digest, as plain data."""
    own = {"format": FORMAT, "version": VERSION, "problem": problem_digest(problem)}
    content: dict[str, Any] = own | to_plain(proof, InfeasibilityProof)
    return content


def read_proof(document: Document) -> SavedProof:
    """Read a proof from a document; every key, length and number is checked, but not what it proves.

    Raises:
        PlanError: Names the file, the key, the value and what is allowed there.
    """
    document.check_entry("format", FORMAT)
    document.check_entry("version", VERSION)
    proof = document.read(InfeasibilityProof, head=("format", "version", "problem"))
    document.check_length("point", 2)
    if not proof.slices:
        document.refuse("slices", [], "at least one slice")
    for k, part in enumerate(proof.slices):
        document.check_intervals(f"slices[{k}].", max(1, len(part.lower)), points=True)
    return SavedProof(document.content["problem"], proof)
