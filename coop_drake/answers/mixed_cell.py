"""What an exploration left undecided on its last channel."""

from __future__ import annotations

from dataclasses import dataclass

from shapely import Polygon

from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class MixedCell:
    """A set of configurations of which neither freedom nor collision was proved.

    Attributes:
        robots: Robots that take part; the axes are theta and the joints of these robots in the order of q.
        lower: Lower ends of the nominal intervals, shape (1 + m,) [rad, m].
        upper: Upper ends, shape (1 + m,).
        polygon: Positions p_WL outside which nothing is free [m].
        width_fraction: Width of its widest interval divided by the range of that axis [-].
        finest: Whether every interval is below the resolution, so that it will not be halved any more.
    """

    robots: tuple[int, ...]
    lower: FloatArray
    upper: FloatArray
    polygon: Polygon
    width_fraction: float
    finest: bool
