"""A proof of infeasibility, and the file ``certificate.json`` that binds it to the question that it refutes.

The fields stand in the order of the file; their types are checked when it is read.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from coop_drake.answers.document import Corners, Document, Region, problem_digest, write_document
from coop_drake.answers.problem import PlanningProblem
from coop_drake.typed_data import EXACT, Limits, Vector, to_plain

# A proof of infeasibility: regions that cover all free configurations and keep start and goal apart.
#
# The fields stand in the order of the file ``certificate.json``; their types are checked when it is read.

Index = Annotated[int, Limits(at_least=0), EXACT]


@dataclass(frozen=True)
class OverCell:
    """A region of positions; all free positions lie in this cell or in another one of its slice.

    Attributes:
        reached: Whether a sequence of touching cells joins it to the start.
        polygon: The positions, a closed set [m].
    """

    reached: bool
    polygon: Region


@dataclass(frozen=True)
class Witness:
    """What pieces hold at every configuration of a slice: it shows collisions.

    Attributes:
        pieces: Number of the piece, in the order of components, bodies and shapes; or numbers of two pieces
            that must not meet, ascending.
        component: Index of the component in whose frame the polygon of two pieces is.
        polygon: Corners of a convex polygon, or one point, in the interior of the pieces, shape (n, 2) [m].
            That of one piece is relative to the position that the proof is about, in directions of W.
    """

    pieces: tuple[Index, ...]
    component: Index
    polygon: Corners


@dataclass(frozen=True)
class Cut:
    """Places of a disc's centre at which it touches a wall: beyond a line, and not beyond those before it.

    Attributes:
        piece: 0 for the first disc of a pair, 1 for the second.
        direction: A unit vector u in W, shape (2,).
        limit: The places x with u . x at least this are nearer to one wall than the disc's radius [m].
    """

    piece: Index
    direction: Vector
    limit: float


@dataclass(frozen=True)
class Squeeze:
    """Positions at which two round pieces touch a wall or each other, at every configuration of a slice.

    Attributes:
        pieces: Numbers of the two pieces, ascending; each is a disc, and they must not meet.
        component: Index of the nearest component that carries both.
        polygon: Corners of a convex polygon, the positions, shape (n, 2) [m].
        cuts: They show where each of the discs touches a wall.
    """

    pieces: tuple[Index, ...]
    component: Index
    polygon: Corners
    cuts: tuple[Cut, ...]


@dataclass(frozen=True)
class OverSlice:
    """A box of angles and joint values, with everything in it that may be free.

    Attributes:
        lower: Lower ends of (angle, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        witnesses: They show that all else is in collision.
        cells: Regions of positions that cover all that is free; none where all of it is in collision.
        squeezes: They show further collisions, of pieces between walls.
    """

    lower: Vector
    upper: Vector
    witnesses: tuple[Witness, ...]
    cells: tuple[OverCell, ...]
    squeezes: tuple[Squeeze, ...] = ()


@dataclass(frozen=True)
class InfeasibilityProof:
    """Cells that keep start and goal apart, for the positions of one point of the team.

    The slices cover a whole turn of the component's angle, in any unwrapping, and the limits of all joints
    without gap or overlap. Cells that touch, in one slice or in two that share a facet, are both reached or
    both not; the start lies in reached ones only, and nothing of the goal, within its tolerances, in them.

    Attributes:
        kind: How it was found: ``slices`` of the team or of a part of it, or a ``blocked goal``. The checker
            does not read it.
        component: Index of the component that the positions and angles are those of.
        point: The point in the component's frame, shape (2,) [m].
        slices: The cover.
    """

    kind: Literal["slices", "blocked goal"]
    component: Index
    point: Vector
    slices: tuple[OverSlice, ...]


# The file ``certificate.json``: a proof of infeasibility, bound to the planning problem that it refutes.

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
