"""Proofs of infeasibility on disk: JSON, the same bytes for the same proof, bound to their question."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.document import Entry
from coop_drake.answers.document_text import document_text, polygon_entry
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import DiscProof, InfeasibilityProof, OverCell, OverSlice, SlicesProof
from coop_drake.answers.proof_reader import FORMAT, KINDS, VERSION, SavedProof, read_proof
from coop_drake.files import write_atomically

__all__ = ["load_proof", "save_proof"]


def save_proof(proof: InfeasibilityProof, problem: PlanningProblem, path: Path | str) -> Path:
    """Write a proof of infeasibility; the file is written whole or not at all.

    Args:
        proof: The proof.
        problem: The question that has no answer.
        path: Where to write it.

    Returns:
        The path written.
    """
    head: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "problem": problem_digest(problem),
        "kind": KINDS[type(proof)],
    }
    if isinstance(proof, DiscProof):
        head.update(component=proof.component, centre=proof.centre.tolist(), radius=proof.radius)
        rows = {"cells": [_cell_entry(cell) for cell in proof.cells]}
    elif isinstance(proof, SlicesProof):
        head["robots"] = proof.robots
        rows = {"slices": [_slice_entry(part) for part in proof.slices]}
    else:
        head["robots"] = proof.robots
        rows = {"slices": [_bounds_entry(part) for part in proof.slices]}
    return write_atomically(path, document_text(head, rows).encode())


def load_proof(path: Path | str) -> SavedProof:
    """Read a proof of infeasibility.

    Args:
        path: A file that ``save_proof`` wrote.

    Raises:
        PlanError: If the file is no such proof: names the file, the key, the value and what is allowed.
    """
    root = Entry.load(path, "a proof of infeasibility")
    saved = read_proof(root)
    root.check_digest()
    return saved


def _cell_entry(cell: OverCell) -> dict[str, Any]:
    return {"reached": cell.reached, "polygon": polygon_entry(cell.polygon)}


def _bounds_entry(part: OverSlice) -> dict[str, Any]:
    return {"lower": part.lower.tolist(), "upper": part.upper.tolist()}


def _slice_entry(part: OverSlice) -> dict[str, Any]:
    return {**_bounds_entry(part), "cells": [_cell_entry(cell) for cell in part.cells]}
