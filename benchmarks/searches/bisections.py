"""What bisections found: the multiple of what is certified up to which no run was lost, if it is known."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, isnan

from benchmarks.searches.findings import BreakingPoint

UNKNOWN = "not determined"
"""What stands in place of a multiple where a bisection found none."""


def is_determined(point: BreakingPoint) -> bool:
    """Whether a bisection came to an end; it did not where its process was lost or no multiple was tried."""
    return not isnan(point.certified) and (point.kept >= 1.0 or isfinite(point.lost))


def is_good(point: BreakingPoint) -> bool:
    """Whether no run was lost at what is certified."""
    return is_determined(point) and point.kept >= 1.0


def multiple_shown(point: BreakingPoint | None) -> str:
    """The largest multiple at which no run was lost, in words; empty without a bisection."""
    if point is None:
        return ""
    if not is_determined(point):
        return UNKNOWN
    return f"{point.kept:.3g}" if point.beyond else f"{point.kept:.3g} or more"


def ends_shown(point: BreakingPoint) -> tuple[str, str, str]:
    """What is certified, up to where no run was lost, and where one was, in the departure's unit."""
    certified = UNKNOWN if isnan(point.certified) else f"{point.certified:.4g}"
    if not is_determined(point):
        return certified, UNKNOWN, UNKNOWN
    lost = f"{point.lost * point.certified:.3g}" if point.beyond else "not found"
    return certified, f"{point.kept * point.certified:.3g}", lost


def sentences(points: Sequence[BreakingPoint]) -> tuple[str, ...]:
    """Say what is bad of bisections; if nothing is, up to which multiple all of them lost no run."""
    determined = [point for point in points if is_determined(point)]
    told = []
    if inside := [point for point in determined if not is_good(point)]:
        least = min(inside, key=lambda point: point.lost)
        told.append(f"A run was lost at {least.lost:.2g} times what is certified ({_name(least)}).")
    if unknown := [point for point in points if not is_determined(point)]:
        several = "1 breaking point is" if len(unknown) == 1 else f"{len(unknown):,} breaking points are"
        told.append(f"{several} {UNKNOWN} ({_name(unknown[0])}{', ...' if len(unknown) > 1 else ''}).")
    if points and not told:
        least = min(points, key=lambda point: point.kept)
        told.append(f"No run was lost up to {least.kept:.2g} times what is certified ({_name(least)}).")
    return tuple(told)


def _name(point: BreakingPoint) -> str:
    return f"{point.departure.replace('_', ' ')}, {point.scenario}"
