"""Check the figures that a plan states about its transitions, by computing them again."""

from __future__ import annotations

from collections.abc import Mapping
from math import isclose

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.answers.plan import Plan, Transition
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet, TransitionGains, transition_gains
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check

__all__ = ["check_figures"]

RELATIVE = 1e-9
"""Relative difference of figures that are computed twice, in another order of operations [-]."""

ERODING_FRACTION = 1e-3
"""Error of eroding with 32 chords for a quarter circle, a bound, as a fraction of the clearance [-]."""

SAME_PLACE = 1e-9
"""Paths shorter than this do not move the position, only angles [m]."""


def check_figures(plan: Plan, gain_sets: Mapping[str, GainSet]) -> tuple[Check, Check, Check]:
    """Compute inradius and gains of every transition again; test its clearance and its length.

    The estimated time comes of a simulation and does not matter for safety: it is the only figure that
    nothing but the digest of the file protects.

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
        inradius = float(transition.goal_region.boundary.distance(Point(transition.target)))
        if not isclose(transition.inradius, inradius, rel_tol=RELATIVE, abs_tol=1e-12):
            raise RefusalError(f"{where}.inradius", f"is {transition.inradius}; expected {inradius}")
        _check_neck(plan.cells[k].tidied, entry, transition, where)
        _check_length(entry, transition, where)
        gains = transition_gains(
            gain_sets[plan.gain_set],
            clearance=transition.neck,
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
        Check(
            "a path to every target keeps the stated clearance",
            len(necks),
            min(necks),
            "m, narrowest passage",
        ),
        Check("inradii are distances, lengths no shorter than straight lines", 2 * len(necks)),
        Check("gains are those that the gain set gives for the cells", len(necks)),
    )


def _check_neck(cell: Polygon, entry: FloatArray, transition: Transition, where: str) -> None:
    """The cell, eroded by the stated clearance, must hold entry and target in one connected part."""
    eroded = cell.buffer(-transition.neck * (1.0 - ERODING_FRACTION), quad_segs=32)
    ends = Point(entry), Point(transition.target)
    if not any(all(part.covers(end) for end in ends) for part in shapely.get_parts(eroded)):
        raise RefusalError(f"{where}.neck", f"no path keeps {transition.neck} m of clearance")


def _check_length(entry: FloatArray, transition: Transition, where: str) -> None:
    straight = float(np.hypot(*(transition.target - entry)))
    if transition.length < straight * (1.0 - RELATIVE):
        raise RefusalError(
            f"{where}.length",
            f"{transition.length} m is less than the straight distance of {straight} m between start and "
            "target of the transition",
        )
    if transition.only_angles != (transition.length <= SAME_PLACE):
        raise RefusalError(f"{where}.only_angles", f"{transition.only_angles} over {transition.length} m")


def _check_gains(found: TransitionGains, expected: TransitionGains, where: str) -> None:
    for name, value in vars(expected).items():
        stated = getattr(found, name)
        text = isinstance(value, str)
        if not (stated == value if text else np.allclose(stated, value, rtol=RELATIVE, atol=0.0)):
            raise RefusalError(f"{where}.{name}", f"is {stated}; the cell gives {value}")
