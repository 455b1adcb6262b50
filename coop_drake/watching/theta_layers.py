"""What is known in every layer of theta: positions over the floor, theta upwards, joints left out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import pairwise
from math import pi
from typing import TypeVar

from manifold3d import CrossSection

from coop_drake.geometry.swept_tree import Interval
from coop_drake.planning.cells.slices import nearest_turn
from coop_drake.watching.components import Components
from coop_drake.watching.keyframes import Keyframe
from coop_drake.watching.projections import Projections, union
from coop_drake.watching.search_states import Leaf

__all__ = ["THETA", "Knowledge", "Slab", "on_turn", "slabs_of"]

THETA: Interval = (-pi / 4, 7 * pi / 4)
"""The turn of theta that is drawn [rad]; coarse slices begin and end there."""

_THINNEST = pi / 64
"""Thinner layers are merged [rad]: they could not be told apart."""

_TOUCH = 1e-9
"""Overlap of intervals that counts as none [rad]."""

Member = TypeVar("Member")


class Knowledge(Enum):
    """What is known about the positions of a slab."""

    FREE = "free"
    """Proved free for some choice of the joints."""
    UNDECIDED = "undecided"
    """May be free for some choice of the joints, not proved."""
    CHANNEL = "channel"
    """A cell of the channel that answers the question."""
    REACHED = "reached"
    """May be free, and joined to the start."""
    OTHERS = "others"
    """May be free, and proved to be apart from the start."""


@dataclass(frozen=True, eq=False)
class Slab:
    """Positions over an interval of theta, shown during some keyframes.

    Attributes:
        knowledge: What is known about them.
        theta: Interval of theta [rad].
        section: Positions p_WL.
        first: Index of the first keyframe that shows it.
        last: Index of the last keyframe that shows it.
    """

    knowledge: Knowledge
    theta: Interval
    section: CrossSection
    first: int
    last: int


def slabs_of(frames: Sequence[Keyframe]) -> list[Slab]:
    """Return the slabs of all keyframes; one that stays as it is from keyframe to keyframe is one slab.

    Every layer of theta shows the union over all joint values: a position is free in it if some choice of
    the joints is proved free there, undecided if some choice may be free. The last keyframe shows the answer
    instead: the cells of the channel, or the components that are proved to be apart.
    """
    answer = _answer(frames[-1], len(frames) - 1)
    finished: list[Slab] = []
    growing: dict[tuple[object, ...], list[Slab]] = {}
    projections: dict[str, Projections] = {}
    for number, frame in enumerate(frames[: len(frames) - 1 if answer else None]):
        own = projections.setdefault(frame.state.question, Projections())
        before, growing = growing, {}
        for theta, leaves in _layers((leaf.intervals[0], leaf) for leaf in frame.state.leaves.values()):
            key = (frame.state.question, theta, *[leaf.slice for leaf in leaves])
            same = before.pop(key, None)
            growing[key] = (
                _slabs(own, theta, leaves, number)
                if same is None
                else [replace(slab, last=number) for slab in same]
            )
        finished += [slab for slabs in before.values() for slab in slabs]
    return [*finished, *(slab for slabs in growing.values() for slab in slabs), *answer]


def on_turn(interval: Interval) -> list[Interval]:
    """Return an interval of theta moved to the turn drawn, in two parts where it crosses the turn's end."""
    lower, upper = interval
    middle = 0.5 * (THETA[0] + THETA[1])
    shift = middle + nearest_turn(0.5 * (lower + upper) - middle) - 0.5 * (lower + upper)
    moved = [(lower + shift + turn, upper + shift + turn) for turn in (0.0, -2.0 * pi, 2.0 * pi)]
    clipped = [(max(a, THETA[0]), min(b, THETA[1])) for a, b in moved]
    return [(a, b) for a, b in clipped if b - a > _TOUCH]


def _slabs(projections: Projections, theta: Interval, leaves: Sequence[Leaf], number: int) -> list[Slab]:
    """Return the slabs of a layer of theta that some leaves meet."""
    projection = projections.of(leaves)
    undecided = projection.guide + projection.mixed
    sections = ((Knowledge.FREE, projection.free), (Knowledge.UNDECIDED, undecided))
    return [
        Slab(what, theta, section, number, number) for what, section in sections if not section.is_empty()
    ]


def _layers(members: Iterable[tuple[Interval, Member]]) -> list[tuple[Interval, list[Member]]]:
    """Return the layers between the ends of intervals of theta, with the members that each meets."""
    placed = [(part, member) for interval, member in members for part in on_turn(interval)]
    layers = []
    for lower, upper in pairwise(_distinct(end for part, _ in placed for end in part)):
        met = [member for (a, b), member in placed if min(b, upper) - max(a, lower) > _TOUCH]
        if met:
            layers.append(((lower, upper), met))
    return layers


def _distinct(values: Iterable[float]) -> list[float]:
    """Return sorted values without those too near to the one before; the largest one is kept."""
    kept: list[float] = []
    largest = -pi
    for value in sorted(values):
        largest = value
        if not kept or value - kept[-1] > _THINNEST - _TOUCH:
            kept.append(value)
    if kept and largest - kept[-1] > _TOUCH:
        kept[1:] = [*kept[1:-1], largest]
    return kept


def _answer(frame: Keyframe, number: int) -> list[Slab]:
    """Return what the last keyframe shows: the channel found, the components proved apart, or nothing."""
    if frame.components is not None:
        return _separate(frame.components, number)
    if not frame.state.channel or frame.state.undecided:
        return []
    return [
        Slab(Knowledge.CHANNEL, theta, cell.region.section, number, number)
        for cell in frame.state.channel
        for theta in on_turn(cell.intervals[0])
    ]


def _separate(components: Components, number: int) -> list[Slab]:
    """Return the over-cells by component, united over the joints, layer by layer."""
    return [
        Slab(what, theta, union(regions), number, number)
        for what, cells in ((Knowledge.REACHED, components.reached), (Knowledge.OTHERS, components.others))
        for theta, regions in _layers((leaf.intervals[0], region) for leaf, region in cells)
    ]
