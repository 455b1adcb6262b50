"""A proof of infeasibility: regions that cover all free configurations and keep start and goal apart.

The fields stand in the order of the file ``certificate.json``; their types are checked when it is read.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from coop_drake.answers.region import Corners, Region
from coop_drake.typed_data import EXACT, Limits, Vector

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
