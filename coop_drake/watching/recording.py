"""What the search did: its events in order, and the states between them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from manifold3d import CrossSection, FillRule

from coop_drake.answers.problem import PlanningProblem, at_goal
from coop_drake.geometry.polygons import polygon_rings
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.exploration import (
    ChannelSearched,
    Event,
    ExplorationBegan,
    ExplorationEnded,
    ExplorationResumed,
    SliceAdded,
    SliceSplit,
    Verdict,
)
from coop_drake.planning.cells.graph import GraphCell, Kind
from coop_drake.planning.channel import Channel
from coop_drake.planning.search import find_channel
from coop_drake.progress import Progress
from coop_drake.tree.arrays import FloatArray

# Recording a search: one planning problem, and all events while the planner answers it.

BOXES = "boxes along a sampled path"
"""The question of the events that add the boxes of a channel one by one."""


Strategy = Literal["cells", "paper", "portfolio"]
"""Which search is recorded: the exploration of the whole team by cells; that exploration as the paper's
Algorithms 1 and 2 are printed; or all that planning does: proofs of infeasibility where it tries them, and
boxes along a sampled path."""


@dataclass(frozen=True, eq=False)
class SearchRecording:
    """A recording of one search.

    Attributes:
        problem: The planning problem.
        events: What happened, in order.
        verdict: How the search ended.
        reason: Why there is no channel, in a sentence; empty if the events say it.
    """

    problem: PlanningProblem
    events: tuple[Event, ...]
    verdict: Verdict
    reason: str = ""

    def axes_of(self, robots: tuple[int, ...]) -> list[int]:
        """Return the indices of theta and of some robots' joints among the axes (theta, q...) of the team."""
        joints = self.problem.tree.joints
        return [0, *[1 + joint.index for joint in joints if joint.robot in robots]]

    def circular_of(self, robots: tuple[int, ...]) -> tuple[bool, ...]:
        """Return which axes of theta and of some robots' joints are circles."""
        circular = self.problem.tree.circular
        return tuple(circular[axis] for axis in self.axes_of(robots))

    def start_of(self, robots: tuple[int, ...]) -> FloatArray:
        """Return the start (x, y, theta, q...) with some robots' joints only, shape (2 + axes,) [m, rad]."""
        return self.problem.start[[0, 1, *[2 + axis for axis in self.axes_of(robots)]]]

    def goal_of(self, robots: tuple[int, ...]) -> FloatArray:
        """Return the goal with some robots' joints only, NaN for free ones, shape (2 + axes,) [m, rad]."""
        goal = at_goal(self.problem.goal_pose, self.problem.goal_joints, np.nan)
        return goal[[0, 1, *[2 + axis for axis in self.axes_of(robots)]]]

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of all axes for captions: θ, then every joint."""
        return ("θ", *(joint.name.replace("::", " ") for joint in self.problem.tree.joints))


def record_search(
    problem: PlanningProblem, strategy: Strategy, progress: Progress | None = None
) -> SearchRecording:
    """Search for a plan, and record every event of the search; of a portfolio also the boxes, one by one.

    The problem's settings give the budget of slices.
    """
    events: list[Event] = []
    asked = replace(problem, settings=replace(problem.settings, strategy=strategy))
    answer, _ = find_channel(asked, progress, watch=events.append)
    last = events[-1] if events else None
    if strategy != "portfolio" and isinstance(last, ExplorationEnded):
        return SearchRecording(problem, tuple(events), Verdict(last.verdict))
    if isinstance(answer, Channel):
        events += _box_events(answer, tuple(sorted({joint.robot for joint in problem.tree.joints})))
        return SearchRecording(problem, tuple(events), Verdict.FOUND)
    verdict = Verdict.INFEASIBLE if answer.proved else Verdict.BUDGET
    if not (isinstance(last, ExplorationEnded) and last.verdict == verdict.value):
        events += [ExplorationBegan(answer.reason, ()), ExplorationEnded(verdict.value, 0)]
    return SearchRecording(problem, tuple(events), verdict, answer.reason)


def _box_events(channel: Channel, robots: tuple[int, ...]) -> list[Event]:
    """Return the boxes of a channel as events: each box is a slice of its own that is free."""
    events: list[Event] = [ExplorationBegan(BOXES, robots)]
    cells: list[GraphCell] = []
    for number, box in enumerate(channel.boxes):
        section = CrossSection(polygon_rings(box.polygon), FillRule.Positive)
        cell = GraphCell(number, number, Kind.FREE, Region.of(section), 1.0)
        cells.append(cell)
        intervals = tuple((float(a), float(b)) for a, b in zip(box.lower, box.upper, strict=True))
        events += [SliceAdded(number, intervals, (cell,)), ChannelSearched(tuple(cells), float(len(cells)))]
    return [*events, ExplorationEnded(Verdict.FOUND.value, len(channel.boxes))]


# What is known at some instants of a search: its events, folded into states.


@dataclass(frozen=True, eq=False)
class Leaf:
    """A slice of the subdivision that is not halved, with its cells.

    Attributes:
        slice: Its id.
        intervals: Nominal interval of every axis (theta, q...) [rad, m].
        cells: Its cells, none where all of it is blocked.
    """

    slice: int
    intervals: Intervals
    cells: tuple[GraphCell, ...]

    def regions(self, kind: Kind) -> list[Region]:
        """Return the regions of its cells of one kind."""
        return [cell.region for cell in self.cells if cell.kind is kind]

    @cached_property
    def free_fraction(self) -> float | None:
        """Area that is proved free, relative to the area that may be free; None where all is blocked."""
        free, possible = (sum(r.area for r in self.regions(kind)) for kind in (Kind.FREE, Kind.MIXED))
        return None if free == possible == 0.0 else free / max(free, possible)


@dataclass(frozen=True, eq=False)
class ChannelCell:
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


@dataclass(eq=False)
class SearchState:
    """What is known after some events of one exploration.

    Attributes:
        question: What is explored, in words.
        robots: Robots that take part; the axes are theta and their joints.
        leaves: Leaves of the subdivision by their ids.
        splits: Slices halved since the state before, with the axis that each was halved along.
        channel: The last channel searched, empty before the first search and where none exists.
        cost: Total weight of that channel's cells, undecided ones the heaviest.
        searched: Whether the last event is a search.
        verdict: Verdict of the exploration, None while it runs.
        history: Slices made, and undecided cells on the channel, at every search so far.
        intervals: Intervals of all slices made, halved ones included, by their ids.
    """

    question: str = ""
    robots: tuple[int, ...] = ()
    leaves: dict[int, Leaf] = field(default_factory=dict)
    splits: tuple[tuple[Leaf, int], ...] = ()
    channel: tuple[ChannelCell, ...] = ()
    cost: float = 0.0
    searched: bool = False
    verdict: str | None = None
    history: tuple[tuple[int, int], ...] = ()
    intervals: dict[int, Intervals] = field(default_factory=dict)

    @property
    def slices(self) -> int:
        """Number of slices made."""
        return len(self.intervals)

    @property
    def undecided(self) -> int:
        """Number of cells of the channel that are not proved free."""
        return sum(cell.kind is not Kind.FREE for cell in self.channel)

    def count(self, kind: Kind) -> int:
        """Return the number of cells of one kind."""
        return sum(cell.kind is kind for leaf in self.leaves.values() for cell in leaf.cells)

    def take(self, event: Event) -> None:
        """Change with one event."""
        self.searched = isinstance(event, ChannelSearched)
        match event:
            case SliceAdded():
                self.leaves[event.slice] = Leaf(event.slice, event.intervals, event.cells)
                self.intervals[event.slice] = event.intervals
                self.verdict = None
            case SliceSplit():
                self.splits += ((self.leaves.pop(event.slice), event.axis),)
            case ChannelSearched():
                self.channel = tuple(
                    ChannelCell(cell.slice, cell.kind, cell.region, self.intervals[cell.slice])
                    for cell in event.cells
                )
                self.cost = event.cost
                self.history += ((self.slices, self.undecided),)
            case ExplorationEnded():
                self.verdict = event.verdict

    def copy(self) -> SearchState:
        """Return the state as it is now, and begin to collect splits anew."""
        now = replace(self, leaves=dict(self.leaves), intervals=dict(self.intervals))
        self.splits = ()
        return now


def search_states(events: Sequence[Event], most: int) -> list[SearchState]:
    """Fold events into at most ``most`` states, spread evenly over the steps, the last one included.

    A step is a slice halved, a channel searched or an exploration begun or ended; steps in between are merged
    into the next state. Where one exploration gives way to another there is always a state.

    Raises:
        ValueError: Fewer than 2 states are asked for.
    """
    if most < 2:
        raise ValueError(f"a recording needs 2 keyframes or more, got {most}")
    return list(_folded(events, _spread(_steps(events), _ends(events), most)))


def _steps(events: Sequence[Event]) -> list[int]:
    """Return the indices of the events that complete a step."""
    last = len(events) - 1
    return [
        index
        for index, event in enumerate(events)
        if index == last
        or isinstance(event, ChannelSearched | ExplorationEnded)
        or (isinstance(event, SliceAdded) and not isinstance(events[index + 1], SliceAdded))
    ]


def _ends(events: Sequence[Event]) -> list[int]:
    """Return the indices of the last events of explorations."""
    begun = [i for i, event in enumerate(events) if isinstance(event, ExplorationBegan | ExplorationResumed)]
    return [i - 1 for i in begun[1:]] + [len(events) - 1]


def _spread(steps: list[int], ends: list[int], most: int) -> set[int]:
    """Choose at most ``most`` of the steps, evenly; ends take the place of their nearest neighbours."""
    places = np.linspace(0, len(steps) - 1, min(most, len(steps))).round().astype(int)
    chosen = {steps[place] for place in places}
    for end in ends:
        spare = chosen - set(ends)
        if end not in chosen and spare:
            chosen.remove(min(spare, key=lambda step: (abs(step - end), step)))
            chosen.add(end)
    return chosen


def _folded(events: Sequence[Event], chosen: set[int]) -> Iterator[SearchState]:
    """Yield the states after the chosen events; every question has a state of its own."""
    states: dict[str, SearchState] = {}
    state = SearchState()
    for index, event in enumerate(events):
        if isinstance(event, ExplorationBegan):
            state = states[event.question] = SearchState(event.question, event.robots)
        elif isinstance(event, ExplorationResumed):
            state = states[event.question]
        else:
            state.take(event)
        if index in chosen:
            yield state.copy()
