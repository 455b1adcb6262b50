"""What an exploration tells whoever watches it: frozen events, one per step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cell_graph import Cell, Kind
from coop_drake.planning.cells.cells import Region


@dataclass(frozen=True, eq=False)
class SeenCell:
    """A cell as a watcher sees it.

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
    """An exploration goes on after others have had their turn.

    Attributes:
        question: What is explored, as it was told when the exploration began.
    """

    question: str


@dataclass(frozen=True, eq=False)
class SliceAdded:
    """A new leaf of the subdivision.

    Attributes:
        slice: Its id.
        intervals: Nominal interval of every axis (theta, q...) [rad, m].
        cells: Its cells: FREE ones, then GUIDE ones, then MIXED ones; none where all of it is blocked.
    """

    slice: int
    intervals: Intervals
    cells: tuple[SeenCell, ...]


@dataclass(frozen=True, eq=False)
class SliceSplit:
    """A leaf is halved; its two halves are added next.

    Attributes:
        slice: Its id.
        axis: Which axis of (theta, q...) is halved.
    """

    slice: int
    axis: int


@dataclass(frozen=True, eq=False)
class ChannelSearched:
    """The cheapest chain of cells from start to goal was searched.

    Attributes:
        cells: The chain; empty where none exists, which is the proof of infeasibility.
        cost: Its total weight, 0 for an empty one.
    """

    cells: tuple[SeenCell, ...]
    cost: float


@dataclass(frozen=True, eq=False)
class ExplorationEnded:
    """A run of the exploration stopped.

    Attributes:
        verdict: Value of its ``Verdict``; "budget spent" may be followed by more slices.
        slices: Compound slices made so far.
    """

    verdict: str
    slices: int


Event = ExplorationBegan | ExplorationResumed | SliceAdded | SliceSplit | ChannelSearched | ExplorationEnded
Watch = Callable[[Event], None]


def seen(cells: Sequence[Cell]) -> tuple[SeenCell, ...]:
    """Cells as a watcher sees them."""
    return tuple(SeenCell(cell.slice, cell.kind, cell.region) for cell in cells)
