"""Moments: what is known at some instants of a recording, folded from its events."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.events import (
    ChannelSearched,
    Event,
    ExplorationBegan,
    ExplorationEnded,
    ExplorationResumed,
    SeenCell,
    SliceAdded,
    SliceSplit,
)


@dataclass(frozen=True, eq=False)
class Leaf:
    """One slice with its cells.

    Attributes:
        slice: Its id.
        intervals: Nominal interval of every axis (theta, q...) [rad, m].
        cells: Its cells, none where all of it is blocked.
    """

    slice: int
    intervals: Intervals
    cells: tuple[SeenCell, ...]

    def regions(self, kind: Kind) -> list[Region]:
        """Regions of its cells of one kind."""
        return [cell.region for cell in self.cells if cell.kind is kind]

    @cached_property
    def free_share(self) -> float | None:
        """Share of what may be free that is proved free, by area; None where all of it is blocked."""
        free, possible = (
            sum(region.area for region in self.regions(kind)) for kind in (Kind.FREE, Kind.MIXED)
        )
        if free == possible == 0.0:
            return None
        return free / max(free, possible)


@dataclass(frozen=True, eq=False)
class Link:
    """One cell of a channel.

    Attributes:
        slice: Id of its slice.
        kind: What is known about it.
        region: Positions p_WL.
        intervals: Interval of every axis (theta, q...) of its slice [rad, m].
    """

    slice: int
    kind: Kind
    region: Region
    intervals: Intervals


@dataclass(frozen=True, eq=False)
class Moment:
    """What is known after some events.

    Attributes:
        question: What is explored, in words.
        robots: Robots that take part; the axes are theta and their joints.
        leaves: Leaves of the subdivision by their ids.
        splits: Slices halved since the moment before, with the axis that each was halved along.
        channel: The last channel searched, empty before the first search and where none exists.
        cost: Total weight of that channel's cells, undecided ones the heaviest.
        searched: Whether the last event is a search.
        slices: Slices made.
        verdict: Verdict of the exploration, None while it runs.
        open_links: Slices made and undecided cells on the channel, at every search so far.
    """

    question: str
    robots: tuple[int, ...]
    leaves: Mapping[int, Leaf]
    splits: tuple[tuple[Leaf, int], ...]
    channel: tuple[Link, ...]
    cost: float
    searched: bool
    slices: int
    verdict: str | None
    open_links: tuple[tuple[int, int], ...]

    def count(self, kind: Kind) -> int:
        """Number of cells of one kind."""
        return sum(cell.kind is kind for leaf in self.leaves.values() for cell in leaf.cells)

    @property
    def undecided_links(self) -> int:
        """Number of cells of the channel that are not proved free."""
        return sum(link.kind is not Kind.FREE for link in self.channel)


def moments(events: Sequence[Event], most: int) -> list[Moment]:
    """Fold events into at most ``most`` moments, spread evenly over the steps, the last one included.

    A step is a slice halved, a channel searched or an exploration begun or ended; steps in between are
    merged into the next moment. Where one exploration gives way to another is a moment of its own.

    Args:
        events: What an exploration told, in order; of several explorations one after the other.
        most: How many moments to make at most, 2 or more.
    """
    if most < 2:
        raise ValueError(f"a recording needs 2 moments or more, got {most}")
    chosen = _spread(_stops(events), _ends(events), most)
    return list(_folded(events, chosen))


def _stops(events: Sequence[Event]) -> list[int]:
    """Indices of the events that complete a step."""
    last = len(events) - 1
    return [
        index
        for index, event in enumerate(events)
        if index == last
        or isinstance(event, ChannelSearched | ExplorationEnded)
        or (isinstance(event, SliceAdded) and not isinstance(events[index + 1], SliceAdded))
    ]


def _ends(events: Sequence[Event]) -> list[int]:
    """Indices of the last events of explorations."""
    begun = [i for i, event in enumerate(events) if isinstance(event, ExplorationBegan | ExplorationResumed)]
    return [i - 1 for i in begun[1:]] + [len(events) - 1]


def _spread(stops: list[int], ends: list[int], most: int) -> set[int]:
    """At most ``most`` of the stops, evenly; ends take the place of their nearest neighbours."""
    places = np.linspace(0, len(stops) - 1, min(most, len(stops))).round().astype(int)
    chosen = {stops[place] for place in places}
    for end in ends:
        spare = chosen - set(ends)
        if end not in chosen and spare:
            chosen.remove(min(spare, key=lambda stop: (abs(stop - end), stop)))
            chosen.add(end)
    return chosen


@dataclass
class _State:
    """Everything known so far, changed by every event."""

    question: str = ""
    robots: tuple[int, ...] = ()
    leaves: dict[int, Leaf] = field(default_factory=dict)
    intervals: dict[int, Intervals] = field(default_factory=dict)
    splits: list[tuple[Leaf, int]] = field(default_factory=list)
    channel: tuple[Link, ...] = ()
    cost: float = 0.0
    verdict: str | None = None
    open_links: list[tuple[int, int]] = field(default_factory=list)

    def take(self, event: Event) -> None:
        """Change with one event."""
        match event:
            case SliceAdded():
                self.leaves[event.slice] = Leaf(event.slice, event.intervals, event.cells)
                self.intervals[event.slice] = event.intervals
                self.verdict = None
            case SliceSplit():
                self.splits.append((self.leaves.pop(event.slice), event.axis))
            case ChannelSearched():
                self.channel = tuple(
                    Link(cell.slice, cell.kind, cell.region, self.intervals[cell.slice])
                    for cell in event.cells
                )
                self.cost = event.cost
                undecided = sum(cell.kind is not Kind.FREE for cell in event.cells)
                self.open_links.append((len(self.intervals), undecided))
            case ExplorationEnded():
                self.verdict = event.verdict

    def moment(self, last: Event) -> Moment:
        """Freeze what is known, and begin to collect splits anew."""
        moment = Moment(
            question=self.question,
            robots=self.robots,
            leaves=dict(self.leaves),
            splits=tuple(self.splits),
            channel=self.channel,
            cost=self.cost,
            searched=isinstance(last, ChannelSearched),
            slices=len(self.intervals),
            verdict=self.verdict,
            open_links=tuple(self.open_links),
        )
        self.splits.clear()
        return moment


def _folded(events: Sequence[Event], chosen: set[int]) -> Iterator[Moment]:
    states: dict[str, _State] = {}
    state = _State()
    for index, event in enumerate(events):
        if isinstance(event, ExplorationBegan):
            state = states[event.question] = _State(event.question, event.robots)
        elif isinstance(event, ExplorationResumed):
            state = states[event.question]
        else:
            state.take(event)
        if index in chosen:
            yield state.moment(event)
