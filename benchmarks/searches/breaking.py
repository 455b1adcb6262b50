"""The multiple of a certified departure at which runs are first lost, by bisection."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

LARGEST = 64.0
"""Multiples beyond this are not tried [-]: no departure is certified with so little of what a loop bears."""


def first_lost(
    lost: Callable[[float], str],
    halvings: int,
    largest: float = LARGEST,
    allowed: Callable[[float], bool] = lambda multiple: True,
) -> tuple[float, float, str]:
    """Return the largest multiple tried at which no run was lost, the smallest one at which one was, and why.

    Multiples are doubled from 1 until a run is lost, and halved while one is; then the interval is bisected.
    That is sound where larger departures lose runs that smaller ones lose, which is not always so: the
    result is a multiple at which a run was lost next to one at which none was.

    Args:
        lost: Simulates runs at a multiple, and returns why the first of them was lost; empty if none was.
        halvings: How often the interval is halved.
        largest: Multiples beyond this are not tried [-].
        allowed: Whether a multiple can be simulated; from the first one on that cannot none is tried.
    """
    kept, upper, reason, multiple = 0.0, inf, "", 1.0
    while upper == inf and multiple <= largest and allowed(multiple):
        if why := lost(multiple):
            upper, reason = multiple, why
        else:
            kept, multiple = multiple, 2.0 * multiple
    for _ in range(halvings if upper < inf else 0):
        middle = 0.5 * (kept + upper)
        if why := lost(middle):
            upper, reason = middle, why
        else:
            kept = middle
    return kept, upper, reason
