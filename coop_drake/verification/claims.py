"""Whether the figures that a plan states about its transitions are true: recomputed one by one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from math import isclose
from typing import Any

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.answers.plan import Plan, Transition
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet, TransitionGains, transition_gains
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check

__all__ = ["check_claims"]

RELATIVE = 1e-9
"""Recomputed figures agree to so many parts."""

NECK_SHARE = 1e-3
"""A neck is tried by eroding with arcs in chords, which are this exact [-]."""

SAME_PLACE = 1e-9
"""Ways shorter than this move only angles [m]."""


def check_claims(plan: Plan, gain_sets: Mapping[str, GainSet]) -> tuple[Check, Check, Check]:
    """Recompute inradius and gains of every transition; test neck and length.

    The estimated time comes of a simulation and is no claim about safety: of all figures it alone is left to
    the document's digest.

    Args:
        plan: The plan.
        gain_sets: The scenario's gain sets by name.

    Raises:
        RefusalError: Names the transition, the figure and what it should be.
    """
    if plan.gain_set not in gain_sets:
        raise RefusalError("gain_set", f"{plan.gain_set!r} is none of {', '.join(sorted(gain_sets))}")
    entry, resting = plan.start[:2], plan.start[2:]
    for k, transition in enumerate(plan.transitions):
        where = f"transitions[{k}]"
        room = float(transition.goal_region.boundary.distance(Point(transition.target)))
        _require_equal(transition.inradius, room, f"{where}.inradius")
        _check_neck(plan.cells[k].tidied, entry, transition, where)
        _check_length(entry, transition, where)
        gains = transition_gains(
            gain_sets[plan.gain_set],
            neck=transition.neck,
            slice_lower=plan.cells[k].lower,
            slice_upper=plan.cells[k].upper,
            goal_lower=transition.goal_lower,
            goal_upper=transition.goal_upper,
            resting=resting,
        )
        _check_gains(transition.gains, gains, f"{where}.gains")
        entry, resting = transition.target, 0.5 * (transition.goal_lower + transition.goal_upper)
    necks = [transition.neck for transition in plan.transitions]
    return (
        Check("some way to the target is as wide as its neck", len(necks), min(necks), "m, narrowest neck"),
        Check("inradii are distances, lengths no shorter than straight lines", 2 * len(necks)),
        Check("gains follow from the cells", len(necks)),
    )


def _check_neck(cell: Polygon, entry: FloatArray, transition: Transition, where: str) -> None:
    """Eroding the cell by the neck must leave both ends joined."""
    eroded = cell.buffer(-transition.neck * (1.0 - NECK_SHARE), quad_segs=32)
    ends = Point(entry), Point(transition.target)
    if not any(all(part.covers(end) for end in ends) for part in shapely.get_parts(eroded)):
        raise RefusalError(f"{where}.neck", f"no way keeps {transition.neck} m of clearance")


def _check_length(entry: FloatArray, transition: Transition, where: str) -> None:
    straight = float(np.hypot(*(transition.target - entry)))
    if transition.length < straight * (1.0 - RELATIVE):
        raise RefusalError(f"{where}.length", f"{transition.length} m is less than the {straight} m between")
    if transition.only_angles != (transition.length <= SAME_PLACE):
        raise RefusalError(f"{where}.only_angles", f"{transition.only_angles} over {transition.length} m")


def _check_gains(found: TransitionGains, expected: TransitionGains, where: str) -> None:
    for (name, mine), theirs in zip(asdict(expected).items(), asdict(found).values(), strict=True):
        same = mine == theirs if isinstance(mine, str) else _close(theirs, mine)
        if not same:
            raise RefusalError(f"{where}.{name}", f"is {theirs}; the cell gives {mine}")


def _close(found: Any, expected: Any) -> bool:
    return bool(np.allclose(found, expected, rtol=RELATIVE, atol=0.0))


def _require_equal(found: float, expected: float, where: str) -> None:
    if not isclose(found, expected, rel_tol=RELATIVE, abs_tol=1e-12):
        raise RefusalError(where, f"is {found}; expected {expected}")
