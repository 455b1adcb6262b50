"""Theta as the vertical axis of a picture: one turn of it, and the layers between the ends of intervals."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from math import pi
from typing import TypeVar

from coop_drake.geometry.swept_tree import Interval
from coop_drake.tree.circles import nearest_turn

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
