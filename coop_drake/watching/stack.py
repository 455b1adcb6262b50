"""The configuration space as a stack: positions over the floor, theta upwards, joints left out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import pairwise
from math import pi

from manifold3d import CrossSection

from coop_drake.geometry.swept_tree import Interval
from coop_drake.planning.cells.slices import nearest_turn
from coop_drake.watching.components import Parts
from coop_drake.watching.moments import Leaf
from coop_drake.watching.shadows import Shadows, union
from coop_drake.watching.storyboard import Shot

__all__ = ["THETA", "Matter", "Slab", "on_turn", "stack"]

THETA: Interval = (-pi / 4, 7 * pi / 4)
"""The turn of theta that is drawn [rad]; coarse slices begin and end there."""

_THINNEST = pi / 64  # Thinner layers are merged [rad].
_TOUCH = 1e-9


class Matter(Enum):
    """What a slab is made of."""

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
    """Positions over an interval of theta, seen during some shots.

    Attributes:
        matter: What it is made of.
        theta: Interval of theta [rad].
        section: Positions p_WL.
        first: Index of the first shot that shows it.
        last: Index of the last shot that shows it.
    """

    matter: Matter
    theta: Interval
    section: CrossSection
    first: int
    last: int


def stack(shots: Sequence[Shot]) -> list[Slab]:
    """Slabs of all shots; one that stays as it is from shot to shot is one slab.

    Every layer of theta shows the union over all joint values: a position is solid in it if some choice of
    the joints is proved free there, haze if some choice may be free. The last shot shows the answer instead:
    the cells of the channel, or the parts that are proved to be apart.
    """
    finished: list[Slab] = []
    growing: dict[tuple[object, ...], list[Slab]] = {}
    shadows: dict[str, Shadows] = {}
    for number, shot in enumerate(shots):
        question = shot.moment.question
        own = shadows.setdefault(question, Shadows())
        layers = [] if number == len(shots) - 1 and _answer(shot, number) else _layers(shot)
        still: dict[tuple[object, ...], list[Slab]] = {}
        for theta, leaves in layers:
            key = (question, theta, *[leaf.slice for leaf in leaves])
            before = growing.pop(key, None)
            if before is None:
                still[key] = _slabs(own, theta, leaves, number)
            else:
                still[key] = [replace(slab, last=number) for slab in before]
        finished += [slab for slabs in growing.values() for slab in slabs]
        growing = still
    finished += [slab for slabs in growing.values() for slab in slabs]
    return finished + _answer(shots[-1], len(shots) - 1)


def on_turn(interval: Interval) -> list[Interval]:
    """An interval of theta moved to the turn drawn and cut at its ends."""
    lower, upper = interval
    middle = 0.5 * (THETA[0] + THETA[1])
    shift = middle + nearest_turn(0.5 * (lower + upper) - middle) - 0.5 * (lower + upper)
    moved = [(lower + shift + turn, upper + shift + turn) for turn in (0.0, -2.0 * pi, 2.0 * pi)]
    clipped = [(max(a, THETA[0]), min(b, THETA[1])) for a, b in moved]
    return [(a, b) for a, b in clipped if b - a > _TOUCH]


def _slabs(shadows: Shadows, theta: Interval, leaves: Sequence[Leaf], number: int) -> list[Slab]:
    shadow = shadows.of(leaves)
    return [
        Slab(matter, theta, section, number, number)
        for matter, section in (
            (Matter.FREE, shadow.free),
            (Matter.UNDECIDED, shadow.guide + shadow.mixed),
        )
        if not section.is_empty()
    ]


def _layers(shot: Shot) -> list[tuple[Interval, list[Leaf]]]:
    """Layers of theta between the ends of slices, with the leaves that each meets."""
    placed = [(part, leaf) for leaf in shot.moment.leaves.values() for part in on_turn(leaf.intervals[0])]
    ends = _apart(end for part, _ in placed for end in part)
    layers = []
    for lower, upper in pairwise(ends):
        met = [leaf for (a, b), leaf in placed if min(b, upper) - max(a, lower) > _TOUCH]
        layers.append(((lower, upper), met))
    return layers


def _apart(values: Iterable[float]) -> list[float]:
    """Sorted values without those too near to the one before, the largest one kept."""
    kept: list[float] = []
    largest = -pi
    for value in sorted(values):
        largest = value
        if not kept or value - kept[-1] > _THINNEST - _TOUCH:
            kept.append(value)
    if kept and largest - kept[-1] > _TOUCH:
        kept[1:] = [*kept[1:-1], largest]
    return kept


def _answer(shot: Shot, number: int) -> list[Slab]:
    """What the last shot shows: the channel found, the parts proved apart, or nothing of its own."""
    if shot.parts is not None:
        return _parted(shot.parts, number)
    if not shot.moment.channel or shot.moment.undecided_links:
        return []
    return [
        Slab(Matter.CHANNEL, theta, link.region.section, number, number)
        for link in shot.moment.channel
        for theta in on_turn(link.intervals[0])
    ]


def _parted(parts: Parts, number: int) -> list[Slab]:
    """Over-cells by part, united over the joints, layer by layer."""
    slabs = []
    for matter, members in ((Matter.REACHED, parts.reached), (Matter.OTHERS, parts.others)):
        placed = [(theta, region) for leaf, region in members for theta in on_turn(leaf.intervals[0])]
        ends = _apart(end for theta, _ in placed for end in theta)
        for lower, upper in pairwise(ends):
            met = [region for (a, b), region in placed if min(b, upper) - max(a, lower) > _TOUCH]
            if met:
                slabs.append(Slab(matter, (lower, upper), union(met), number, number))
    return slabs
