"""Keyframes of a search: the moments that pictures show, with captions, layers of angles, ways through."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import TypeVar

import numpy as np
import shapely
from manifold3d import CrossSection, OpType
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from shapely import Point, Polygon

from coop_drake.geometry.minkowski import to_polygon
from coop_drake.geometry.swept_tree import Interval
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.exploration import Verdict
from coop_drake.planning.cells.graph import Kind, holds, share_facet
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import nearest_turn, turns_to
from coop_drake.watching.recording import (
    BOXES,
    ChannelCell,
    Leaf,
    SearchRecording,
    SearchState,
    search_states,
)

THETA: Interval = (-pi / 4, 7 * pi / 4)
"""The turn of theta that is drawn [rad]; coarse slices begin and end there."""

_TOUCH = 1e-9
"""Overlap of intervals that counts as none [rad]."""

Member = TypeVar("Member")


def on_turn(interval: Interval) -> list[Interval]:
    """Return an interval of theta moved to the turn drawn, in two parts where it crosses the turn's end."""
    lower, upper = interval
    middle = 0.5 * (THETA[0] + THETA[1])
    shift = middle + nearest_turn(0.5 * (lower + upper) - middle) - 0.5 * (lower + upper)
    moved = [(lower + shift + turn, upper + shift + turn) for turn in (0.0, -2.0 * pi, 2.0 * pi)]
    clipped = [(max(a, THETA[0]), min(b, THETA[1])) for a, b in moved]
    return [(a, b) for a, b in clipped if b - a > _TOUCH]


def layers(members: Iterable[tuple[Interval, Member]]) -> list[tuple[Interval, list[Member]]]:
    """Return the layers of the turn between the ends of intervals of theta, with the members meeting each."""
    placed = [(part, member) for interval, member in members for part in on_turn(interval)]
    found = []
    for lower, upper in pairwise(sorted({end for part, _ in placed for end in part})):
        met = [member for (a, b), member in placed if min(b, upper) - max(a, lower) > _TOUCH]
        if met and upper - lower > _TOUCH:
            found.append(((lower, upper), met))
    return found


# Projections of cells to the floor: unions of regions over the axes that a picture leaves out.


_OUTLINE_TOLERANCE = 0.005
"""Distance by which outlines may move when they are simplified for drawing [m]: less than a pixel."""

_AT_ONCE = 8
"""Number of sections that are united at once; hundreds at once take ten times as long."""


@dataclass(frozen=True, eq=False)
class Projection:
    """Positions by what is known for at least one choice of the axes left out; the three do not overlap.

    Attributes:
        free: Proved free.
        guide: Free in the middle of some slice, not proved.
        mixed: All else that may be free.
    """

    free: CrossSection
    guide: CrossSection
    mixed: CrossSection


def union(regions: Iterable[Region]) -> CrossSection:
    """Return the union of regions, simplified by millimetres: for drawing, never for proofs."""
    sections = [region.section.simplify(_OUTLINE_TOLERANCE) for region in regions]
    while len(sections) > 1:
        blocks = [sections[i : i + _AT_ONCE] for i in range(0, len(sections), _AT_ONCE)]
        united = [CrossSection.batch_boolean(block, OpType.Add) for block in blocks]
        sections = [section.simplify(_OUTLINE_TOLERANCE) for section in united]
    return sections[0] if sections else CrossSection()


def projection_of(leaves: Sequence[Leaf]) -> Projection:
    """Return the projection of the cells of some slices of one exploration."""
    free, guide, mixed = (
        union(region for leaf in leaves for region in leaf.regions(kind))
        for kind in (Kind.FREE, Kind.GUIDE, Kind.MIXED)
    )
    guide = guide - free
    return Projection(free, guide, mixed - free - guide)


# A path through a channel: shortest inside every region, theta moving with it; a sketch, not a plan.


_INSET = 0.02
"""Distance by which crossings stay inside what two regions share, where that is wide enough [m]."""

_PATH_TOLERANCE = 0.01
"""Distance by which outlines may move when they are simplified [m]: fewer corners, quicker paths."""


@dataclass(frozen=True, eq=False)
class PathPiece:
    """The path through one cell.

    Attributes:
        kind: What is known about the cell.
        positions: Shape (k, 2), k >= 2 [m].
        angles: (theta, q...) along it, circular axes unwrapped piece by piece, shape (k, 1 + n) [rad, m].
    """

    kind: Kind
    positions: FloatArray
    angles: FloatArray


def path_through(
    channel: Sequence[ChannelCell], start: FloatArray, goal: FloatArray, circular: Sequence[bool]
) -> list[PathPiece]:
    """Return a path from start to goal through the cells of a channel; each region meets the next.

    Args:
        channel: The cells.
        start: (x, y, theta, q...), shape (2 + axes,) [m, rad].
        goal: (x, y, theta, q...) at the goal; NaN for joints that are free.
        circular: Which of (theta, q...) are circles.
    """
    pieces: list[PathPiece] = []
    polygons = [_simplified(to_polygon(cell.region.section)) for cell in channel]
    here, angles = np.asarray(start[:2]), np.asarray(start[2:])
    for number, cell in enumerate(channel):
        if number + 1 == len(channel) and not cell.region.holds(goal[:2]):
            there, then = here, angles  # The channel is not complete yet.
        elif number + 1 < len(channel):
            there = _crossing(polygons[number], polygons[number + 1], here)
            then = _shared_angles(cell, channel[number + 1], angles, circular)
        else:
            there, then = np.asarray(goal[:2]), np.where(np.isnan(goal[2:]), angles, goal[2:])
            then = then + turns_to(then.tolist(), angles.tolist(), circular)
        positions = _shortest_inside(polygons[number], here, there)
        steps = np.hypot(*np.diff(positions, axis=0).T)
        fraction = np.concatenate([[0.0], np.cumsum(steps)]) / max(float(steps.sum()), 1e-12)
        fraction[-1] = 1.0
        pieces.append(PathPiece(cell.kind, positions, angles + fraction[:, None] * (then - angles)))
        here, angles = there, then
    return pieces


def _simplified(polygon: Polygon) -> Polygon:
    """Return a polygon with fewer corners, or itself where it would fall apart."""
    simpler = polygon.simplify(_PATH_TOLERANCE)
    return simpler if isinstance(simpler, Polygon) and simpler.is_valid else polygon


def _crossing(first: Polygon, second: Polygon, here: FloatArray) -> FloatArray:
    """Return the point of both polygons nearest to ``here``, a little inside where they overlap widely."""
    shared = shapely.intersection(first, second)
    inner = shared.buffer(-_INSET)
    target = shared if inner.is_empty else inner
    if target.is_empty:
        target = second  # Regions that meet may lose the touch when they are straightened.
    nearest = shapely.shortest_line(target, Point(here))
    return np.asarray(nearest.coords[0])


def _shared_angles(
    cell: ChannelCell, following: ChannelCell, angles: FloatArray, circular: Sequence[bool]
) -> FloatArray:
    """Return the angles in both cells' intervals nearest to ``angles``, circular ones on the nearest turn."""
    result = []
    here, there = ([0.5 * (low + high) for low, high in part.intervals] for part in (cell, following))
    turns = turns_to(here, angles.tolist(), circular)
    turns_there = turns_to(there, (np.array(here) + turns).tolist(), circular)
    for axis, ((a, b), (c, d)) in enumerate(zip(cell.intervals, following.intervals, strict=True)):
        turn_a, turn_c = turns[axis], turns_there[axis]
        low, high = max(a + turn_a, c + turn_c), min(b + turn_a, d + turn_c)
        result.append(float(np.clip(angles[axis], min(low, high), max(low, high))))
    return np.array(result)


def _shortest_inside(polygon: Polygon, here: FloatArray, there: FloatArray) -> FloatArray:
    """Return the shortest path between two points of a polygon, shape (k, 2); straight if there is none."""
    ends = np.array([here, there])
    inside = polygon.buffer(1e-6)
    if inside.covers(shapely.LineString(ends)):
        return ends
    rings = [polygon.exterior, *polygon.interiors]
    nodes = np.concatenate([ends, *[np.asarray(ring.coords)[:-1] for ring in rings]])
    i, j = np.triu_indices(len(nodes), 1)
    lines = np.asarray(shapely.linestrings(np.stack([nodes[i], nodes[j]], axis=1)))
    shapely.prepare(inside)
    seen = shapely.covers(inside, lines)
    lengths = np.maximum(shapely.length(lines[seen]), 1e-9)
    graph = csr_array((lengths, (i[seen], j[seen])), shape=(len(nodes), len(nodes)))
    _, back = dijkstra(graph, directed=False, indices=np.array([0]), return_predecessors=True)
    if back[0, 1] < 0:
        return ends
    visited = [1]
    while visited[-1] != 0:
        visited.append(int(back[0, visited[-1]]))
    return nodes[visited[::-1]]


# Which over-cells may still be reached from the start: the components that a proof keeps apart.


_SLACK = 1e-6
"""Slack of the quick test for neighbours that goes before the exact one [rad, m]."""


@dataclass(frozen=True, eq=False)
class Components:
    """Over-cells, divided by whether a sequence of meeting over-cells joins them to the start.

    Attributes:
        reached: Slice and region of every over-cell that is joined to the start.
        others: Slice and region of every over-cell that is not.
    """

    reached: tuple[tuple[Leaf, Region], ...]
    others: tuple[tuple[Leaf, Region], ...]


def components_from_start(leaves: Sequence[Leaf], start: FloatArray, circular: Sequence[bool]) -> Components:
    """Divide the over-cells of a subdivision into those that are joined to the start and the others.

    The start is (x, y, theta, q...) with the joints that the subdivision has, shape (2 + axes,) [m, rad];
    ``circular`` says which of (theta, q...) are circles.
    """
    cells = [(leaf, region) for leaf in leaves for region in leaf.regions(Kind.MIXED)]
    angles = [float(angle) for angle in start[2:]]
    front = [
        cell
        for cell, (leaf, region) in enumerate(cells)
        if holds(leaf.intervals, angles, circular) and region.holds(start[:2])
    ]
    unseen = np.ones(len(cells), dtype=bool)
    unseen[front] = False
    bounds = np.array([leaf.intervals for leaf, _ in cells]).reshape(len(cells), len(angles), 2)
    middle, half = bounds.mean(axis=2), 0.5 * np.ptp(bounds, axis=2)
    while front:
        cell = front.pop()
        leaf, region = cells[cell]
        away = np.abs(middle - middle[cell])
        away = np.where(circular, np.minimum(away, np.abs(2.0 * np.pi - away)), away)
        near = unseen & (away <= half + half[cell] + _SLACK).all(axis=1)
        for other in np.flatnonzero(near).tolist():
            beside, beyond = cells[other]
            adjoin = beside is not leaf and share_facet(leaf.intervals, beside.intervals, circular)
            if adjoin and region.meets(beyond):
                unseen[other] = False
                front.append(other)
    return Components(
        tuple(cell for cell, apart in zip(cells, unseen, strict=True) if not apart),
        tuple(cell for cell, apart in zip(cells, unseen, strict=True) if apart),
    )


# What happens at a keyframe, in words.


def headline(recording: SearchRecording, state: SearchState) -> str:
    """Return what happened since the keyframe before, or how the search ended."""
    if state.verdict is not None:
        return _verdict(recording, state)
    if state.question == BOXES:
        return f"Box {len(state.channel)} is added: all of it is free"
    if state.splits:
        leaf, axis = state.splits[-1]
        along = recording.axis_names[recording.axes_of(state.robots)[axis]]
        if len(state.splits) == 1:
            return f"Slice {leaf.slice} is halved along {along}"
        return f"{len(state.splits)} slices are halved, the last one ({leaf.slice}) along {along}"
    if state.searched:
        return f"The cheapest channel has {len(state.channel)} cells, {state.undecided} undecided"
    return f"{len(state.leaves)} coarse slices of θ to begin with"


def counters(state: SearchState) -> str:
    """Return how far the search is, in numbers."""
    if state.question == BOXES:
        return f"{len(state.channel)} boxes, each of which overlaps the one before"
    free, mixed = state.count(Kind.FREE), state.count(Kind.MIXED)
    parts = [
        f"{state.slices} slices made, {len(state.leaves)} in use",
        f"{free} free and {mixed} undecided cells",
    ]
    if state.channel:
        undecided = f"{state.undecided} undecided" if state.undecided else "all free"
        parts.append(f"channel of {len(state.channel)} cells, {undecided}, cost {state.cost:.0f}")
    return "  ·  ".join(parts)


def _verdict(recording: SearchRecording, state: SearchState) -> str:
    """Return how the search ended."""
    if state.verdict == Verdict.FOUND.value and state.question == BOXES:
        return f"Found: {len(state.channel)} boxes join start and goal, which the plan is made of"
    if state.verdict == Verdict.FOUND.value:
        return f"Found: {len(state.channel)} free cells join start and goal"
    if state.verdict == Verdict.INFEASIBLE.value:
        if recording.reason:
            return f"Infeasible, proved: {recording.reason}"
        return "Infeasible, proved: start and goal lie in separate parts of what may be free"
    if recording.reason:
        return f"Undecided: {recording.reason}"
    if state.verdict == Verdict.BUDGET.value:
        return f"Undecided: the budget of slices is spent, {state.undecided} cells to prove"
    return f"Undecided: {state.undecided} cells of the channel are as fine as the resolution"


# Keyframes of a recording: all that the figures and the scene draw, worked out before drawing.


@dataclass(frozen=True, eq=False)
class Keyframe:
    """One state of a search, ready to draw.

    Attributes:
        state: What is known.
        headline: What just happened, or the verdict.
        counters: How far the search is.
        projection: What is known about every position, for some choice of the angles.
        path: The line through the channel, cell by cell.
        components: What start and goal lie in, once they are proved to be apart; else None.
        cut_at: Point (theta, q...) of the exploration's axes through which subdivisions are cut,
            shape (1 + n,) [rad, m].
    """

    state: SearchState
    headline: str
    counters: str
    projection: Projection
    path: tuple[PathPiece, ...]
    components: Components | None
    cut_at: FloatArray


def keyframes(recording: SearchRecording, most: int) -> list[Keyframe]:
    """Choose at most ``most`` states of a recording and work out what to draw of each."""
    frames: list[Keyframe] = []
    for state in search_states(recording.events, most):
        frames.append(_keyframe(recording, state, frames[-1] if frames else None))
    return frames


def _keyframe(recording: SearchRecording, state: SearchState, before: Keyframe | None) -> Keyframe:
    start, goal = recording.start_of(state.robots), recording.goal_of(state.robots)
    circular = recording.circular_of(state.robots)
    if before is not None and before.state.question != state.question:
        before = None
    if before is not None and before.state.channel is state.channel:
        path = before.path
    else:
        path = tuple(path_through(state.channel, start, goal, circular))
    if state.splits:
        cut_at = np.array([0.5 * (lower + upper) for lower, upper in state.splits[-1][0].intervals])
    else:
        cut_at = start[2:] if before is None else before.cut_at
    leaves = list(state.leaves.values())
    apart = state.verdict == Verdict.INFEASIBLE.value
    return Keyframe(
        state=state,
        headline=headline(recording, state),
        counters=counters(state),
        projection=projection_of(leaves),
        path=path,
        components=components_from_start(leaves, start, circular) if apart else None,
        cut_at=cut_at,
    )
