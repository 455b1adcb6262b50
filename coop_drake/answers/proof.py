"""Why no plan exists, in a form that can be checked again: covers whose parts keep start and goal apart."""

from __future__ import annotations

from dataclasses import dataclass

from shapely import Polygon

from coop_drake.tree.pose import FloatArray

__all__ = ["BlockedGoalProof", "DiscProof", "InfeasibilityProof", "OverCell", "OverSlice", "SlicesProof"]


@dataclass(frozen=True)
class OverCell:
    """A region of positions outside which, cells beside it aside, nothing is free.

    Attributes:
        polygon: The positions, closed [m].
        reached: Whether some chain of touching cells joins it to the start.
    """

    polygon: Polygon
    reached: bool


@dataclass(frozen=True)
class OverSlice:
    """One leaf of a subdivision with everything in it that may be free.

    Attributes:
        lower: Lower ends of the nominal intervals of (theta, kept joints...), shape (1 + m,) [rad, m].
        upper: Upper ends, shape (1 + m,).
        cells: Regions of p_WL that cover all free positions of the slice; none where all of it is blocked.
    """

    lower: FloatArray
    upper: FloatArray
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

    robots: tuple[int, ...]
    slices: tuple[OverSlice, ...]


@dataclass(frozen=True)
class DiscProof:
    """A disc inside one component cannot get from where the start puts it to where the goal wants it.

    Attributes:
        component: Index of the component in the tree.
        centre: The disc's centre in the component's frame, shape (2,) [m].
        radius: Its radius [m].
        cells: Regions of the centre's positions in W that cover all those at which the disc fits.
    """

    component: int
    centre: FloatArray
    radius: float
    cells: tuple[OverCell, ...]


@dataclass(frozen=True)
class BlockedGoalProof:
    """The team collides at the goal pose whatever its free joints.

    Attributes:
        robots: Robots that are kept, ascending, as in ``SlicesProof``.
        slices: Boxes that cover the goal's theta (both ends of axis 0 are the goal's), the goals of joints
            that have one, and the limits of the other joints; none of them has a cell that holds the goal's
            position, and their ``cells`` are empty.
    """

    robots: tuple[int, ...]
    slices: tuple[OverSlice, ...]


InfeasibilityProof = SlicesProof | DiscProof | BlockedGoalProof
