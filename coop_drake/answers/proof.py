"""Proofs of infeasibility: regions that cover all free configurations and keep start and goal apart.

The fields stand in the order of the file ``certificate.json``; their types are checked when it is read.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from coop_drake.answers.region import Region, Ring
from coop_drake.typed_data import EXACT, Limits, Vector

Index = Annotated[int, Limits(at_least=0), EXACT]


@dataclass(frozen=True)
class OverCell:
    """A region of positions; all free positions lie in this cell or in another one of its cover.

    Attributes:
        reached: Whether a sequence of touching cells joins it to the start.
        polygon: The positions, a closed set [m].
    """

    reached: bool
    polygon: Region


@dataclass(frozen=True)
class InnerSweep:
    """A convex polygon that lies inside a piece of a body at every configuration of a slice.

    Attributes:
        piece: Number of the piece, in the order of components, bodies and shapes.
        polygon: Vertices relative to the object's origin, in directions of W, shape (n, 2) [m].
    """

    piece: Index
    polygon: Ring


@dataclass(frozen=True)
class Overlap:
    """A point that lies inside two pieces at every configuration of a slice.

    Attributes:
        pieces: Numbers of the two pieces, ascending.
        point: The point in the frame of the nearest component that carries both, shape (2,) [m].
    """

    pieces: tuple[Index, ...]
    point: Vector


@dataclass(frozen=True)
class AngleBox:
    """Intervals of theta and of the joints of the robots that are kept, with what shows collisions in them.

    Attributes:
        lower: Lower ends of the nominal intervals of (theta, kept joints...), shape (1 + m,) [rad, m].
        upper: Upper ends, shape (1 + m,).
        overlaps: Where two pieces overlap in the whole slice, if that is known.
        inner_sweeps: What pieces cover: positions at which it meets a wall are in collision.
    """

    lower: Vector
    upper: Vector
    overlaps: tuple[Overlap, ...]
    inner_sweeps: tuple[InnerSweep, ...]


@dataclass(frozen=True)
class OverSlice(AngleBox):
    """One leaf of a subdivision with everything in it that may be free.

    Attributes:
        cells: Regions of p_WL that cover all free positions of the slice; none where all of it is blocked.
    """

    cells: tuple[OverCell, ...]


@dataclass(frozen=True)
class SlicesProof:
    """The over-approximations of some robots with the object keep start and goal apart.

    The slices cover theta (a whole turn, in any unwrapping) and the limits of the kept joints without gap or
    overlap. Cells that touch, in one slice or in two that share a facet, are both reached or both not; the
    start lies in reached ones only and the goal in none of them.

    Attributes:
        robots: Robots that are kept, ascending; what is welded to the object is kept in any case. The axes
            are theta and the joints of these robots in the order of q.
        slices: The cover.
    """

    robots: tuple[Index, ...]
    slices: tuple[OverSlice, ...]


@dataclass(frozen=True)
class DiscProof:
    """A disc in one component cannot get from its place at the start to any place it may have at the goal.

    Attributes:
        component: Index of the component in the tree.
        centre: The disc's centre in the component's frame, shape (2,) [m].
        slices: One slice of all angles; its cells and inner sweeps are about the centre's positions in W.
    """

    component: Index
    centre: Vector
    slices: tuple[OverSlice, ...]


@dataclass(frozen=True)
class BlockedGoalProof:
    """The team collides at the goal pose whatever its free joints.

    Attributes:
        robots: Robots that are kept, ascending, as in ``SlicesProof``.
        slices: Boxes that cover the goal's theta (both ends of axis 0 are the goal's), the goals of joints
            that have one, and the limits of the other joints. In each of them the team collides at the goal's
            position.
    """

    robots: tuple[Index, ...]
    slices: tuple[AngleBox, ...]


InfeasibilityProof = SlicesProof | DiscProof | BlockedGoalProof
