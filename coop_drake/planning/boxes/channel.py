"""What a search returns: a channel, the chain of free boxes before it is made ready to execute, or none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from shapely import Polygon

from coop_drake.answers.mixed_cell import MixedCell
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.tree.pose import FloatArray


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
        path: The path that the boxes were laid along, theta unwrapped like theirs, shape (m, 3 + n); None if
            they were not laid along any.
    """

    boxes: tuple[FreeBox, ...]
    margin: float
    goal_angle: float
    path: FloatArray | None = None


@dataclass(frozen=True)
class Way:
    """A path that is covered with boxes proved free; their polygons are made where they are asked for.

    Attributes:
        path: From start to goal, theta unwrapped, shape (m, 3 + n).
        margin: The margin rho that the path keeps in every box [m].
        boxes: How many boxes cover it.
        channel: Makes the channel of these boxes; raises a GeometryError where geometry fails.
    """

    path: FloatArray
    margin: float
    boxes: int
    channel: Callable[[], Channel]


@dataclass(frozen=True)
class NoChannel:
    """No channel was found.

    Attributes:
        proved: True if none exists, False if the work or the resolution ended first.
        reason: Why, in a sentence.
        proof: The proof in a form that can be checked again, where there is one.
        mixed: Where nothing was proved: what the last exploration left undecided, the widest first.
    """

    proved: bool
    reason: str
    proof: InfeasibilityProof | None = None
    mixed: tuple[MixedCell, ...] = ()
