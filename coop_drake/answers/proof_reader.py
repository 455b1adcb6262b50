"""A proof of infeasibility from its JSON document: every key, length, number and shape is checked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.answers.document import Entry
from coop_drake.answers.proof import (
    BlockedGoalProof,
    DiscProof,
    InfeasibilityProof,
    OverCell,
    OverSlice,
    SlicesProof,
)
from coop_drake.errors import PlanError

__all__ = ["FORMAT", "KINDS", "VERSION", "SavedProof", "read_proof"]

FORMAT = "coop_drake proof of infeasibility"
"""What the document says it is."""

VERSION = 1
"""Version of its layout; another one is refused."""

KINDS: dict[type, str] = {SlicesProof: "slices", DiscProof: "disc", BlockedGoalProof: "blocked goal"}
"""How the document names the kinds of proof."""

_HEAD = ("format", "version", "problem", "kind", "digest")


@dataclass(frozen=True)
class SavedProof:
    """A proof with the question it belongs to.

    Attributes:
        problem: Digest of the question.
        proof: The proof.
    """

    problem: str
    proof: InfeasibilityProof


def read_proof(root: Entry) -> SavedProof:
    """Read a proof from a document.

    Args:
        root: The whole document.

    Raises:
        PlanError: Names the file, the key, the value and what is allowed there.
    """
    kind = root.value.get("kind") if isinstance(root.value, dict) else None
    own = ("component", "centre", "radius", "cells") if kind == "disc" else ("robots", "slices")
    entry = root.fields(*_HEAD, *own)
    entry["format"].one_of(FORMAT)
    entry["version"].one_of(VERSION)
    entry["kind"].one_of(*KINDS.values())
    proof: InfeasibilityProof
    if kind == "disc":
        proof = DiscProof(
            component=_count(entry["component"]),
            centre=entry["centre"].numbers(2),
            radius=entry["radius"].number(positive=True),
            cells=tuple(_cell(cell) for cell in entry["cells"].items()),
        )
    else:
        robots = tuple(_count(robot) for robot in entry["robots"].items())
        parts = entry["slices"].items(at_least=1)
        if kind == "slices":
            proof = SlicesProof(robots, tuple(_slice(part) for part in parts))
        else:
            proof = BlockedGoalProof(robots, tuple(_box(part.fields("lower", "upper")) for part in parts))
    return SavedProof(entry["problem"].text(), proof)


def _slice(entry: Entry) -> OverSlice:
    fields = entry.fields("lower", "upper", "cells")
    box = _box(fields)
    return OverSlice(box.lower, box.upper, tuple(_cell(cell) for cell in fields["cells"].items()))


def _box(fields: dict[str, Entry]) -> OverSlice:
    axes = len(fields["lower"].items(at_least=1))
    lower, upper = fields["lower"].numbers(axes), fields["upper"].numbers(axes)
    if (lower > upper).any():
        entry, axis = fields["upper"], int(np.argmax(lower > upper))
        raise PlanError(
            f"{entry.file}: {entry.key}[{axis}]: {upper[axis]} is not allowed; expected {lower[axis]} or more"
        )
    return OverSlice(lower, upper, ())


def _cell(entry: Entry) -> OverCell:
    fields = entry.fields("reached", "polygon")
    return OverCell(fields["polygon"].polygon(), fields["reached"].flag())


def _count(entry: Entry) -> int:
    number = entry.number(at_least=0)
    if number != int(number) or not isinstance(entry.value, int):
        entry.refuse("a whole number")
    return int(number)
