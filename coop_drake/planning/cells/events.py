"""Events of an exploration, one for each step, for displays of the search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cell_graph import GraphCell, Kind
from coop_drake.planning.cells.cells import Region


@dataclass(frozen=True, eq=False)
class SeenCell:
    """A cell of the graph, as events show it.

    Attributes:
        slice: Id of its slice.
        kind: What is known about it.
        region: Positions p_WL.
    """

    slice: int
    kind: Kind
    region: Region


@dataclass(frozen=True, eq=False)
class ExplorationBegan:
    """A question is explored from its coarsest slices on.

    Attributes:
        question: What is explored, in words: the whole team or a part of it.
        robots: Robots that take part.
    """

    question: str
    robots: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class ExplorationResumed:
    """An exploration continues after other explorations had their turn.

    Attributes:
        question: What is explored, as in ``ExplorationBegan``.
    """

    question: str


@dataclass(frozen=True, eq=False)
class SliceAdded:
    """A new leaf of the subdivision.

    Attributes:
        slice: Its id.
        intervals: Nominal interval of every axis (theta, q...) [rad, m].
        cells: Its cells, ordered FREE, GUIDE, MIXED; empty where the whole slice is blocked.
    """

    slice: int
    intervals: Intervals
    cells: tuple[SeenCell, ...]


@dataclass(frozen=True, eq=False)
class SliceSplit:
    """A leaf is halved; two events ``SliceAdded`` for its halves follow.

    Attributes:
        slice: Its id.
        axis: Which axis of (theta, q...) is halved.
    """

    slice: int
    axis: int


@dataclass(frozen=True, eq=False)
class ChannelSearched:
    """The cheapest path of cells from start to goal was searched.

    Attributes:
        cells: The path; empty if none exists, which proves infeasibility.
        cost: Its total weight, 0 for an empty path.
    """

    cells: tuple[SeenCell, ...]
    cost: float


@dataclass(frozen=True, eq=False)
class ExplorationEnded:
    """A run of the exploration stopped.

    Attributes:
        verdict: Value of its ``Verdict``; after "budget spent" the exploration may be resumed.
        slices: Compound slices made so far.
    """

    verdict: str
    slices: int


Event = ExplorationBegan | ExplorationResumed | SliceAdded | SliceSplit | ChannelSearched | ExplorationEnded
Watch = Callable[[Event], None]


def seen(cells: Sequence[GraphCell]) -> tuple[SeenCell, ...]:
    """Cells of the graph, as events show them."""
    return tuple(SeenCell(cell.slice, cell.kind, cell.region) for cell in cells)
