"""A channel: the chain of free boxes that a search returns, before it is made ready to execute."""

from __future__ import annotations

from dataclasses import dataclass

from shapely import Polygon

from coop_drake.geometry.pose import FloatArray


@dataclass(frozen=True)
class FreeBox:
    """A set of configurations proved free: every position in ``polygon`` with every angle in the intervals.

    Attributes:
        polygon: Positions p_WL, one connected component of the under-approximation at margin zero [m].
        core: The same at the plan's margin, inside ``polygon``, one connected component [m].
        lower: Lower ends of (theta, q...), expanded by the overlap, theta unwrapped, shape (1 + n,).
        upper: Upper ends, shape (1 + n,).
    """

    polygon: Polygon
    core: Polygon
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True)
class Channel:
    """Consecutive boxes overlap with interior: their cores in the plane, their intervals in every angle.

    Attributes:
        boxes: From the box that holds the start to the one that holds the goal.
        margin: The margin rho that the cores keep [m].
        goal_angle: The goal's theta, unwrapped along the boxes [rad].
    """

    boxes: tuple[FreeBox, ...]
    margin: float
    goal_angle: float


@dataclass(frozen=True)
class SearchReport:
    """What the search did.

    Attributes:
        slices: Compound slices swept, all attempts together: those of explorations and the boxes that were
            tried along sampled paths.
        free_cells: Under-cells found in the last attempt.
        mixed_cells: Undecided over-cells left in the last attempt.
        margins: Margins tried, in order, each with its verdict.
        resolution: For an undecided answer: the widest slice left on the channel, as a fraction of its axis.
    """

    slices: int
    free_cells: int
    mixed_cells: int
    margins: tuple[tuple[float, str], ...]
    resolution: float | None = None
