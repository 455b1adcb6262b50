"""A plan from its JSON document: every key, length, number and shape is checked on the way."""

from __future__ import annotations

from math import inf

import numpy as np

from coop_drake.answers.document import Entry
from coop_drake.answers.plan import Cell, Plan, Transition
from coop_drake.errors import PlanError
from coop_drake.laws import TransitionGains
from coop_drake.tree.pose import FloatArray

__all__ = ["FORMAT", "VERSION", "read_plan"]

FORMAT = "coop_drake plan"
"""What the document says it is."""

VERSION = 2
"""Version of its layout; another one is refused."""


def read_plan(root: Entry) -> Plan:
    """Read a plan from a document.

    Args:
        root: The whole document.

    Raises:
        PlanError: Names the file, the key, the value and what is allowed there.
    """
    entry = root.fields(
        "format", "version", "problem", "gain_set", "margin", "joint_names", "start", "goal_pose",
        "goal_joints", "digest", "cells", "transitions",
    )  # fmt: skip
    entry["format"].one_of(FORMAT)
    entry["version"].one_of(VERSION)
    names = tuple(name.text() for name in entry["joint_names"].items())
    cells = entry["cells"].items(at_least=1)
    goals = entry["goal_joints"].items(exactly=len(names))
    axes = 1 + len(names)
    return Plan(
        cells=tuple(_cell(cell, axes) for cell in cells),
        transitions=tuple(_transition(item, axes) for item in entry["transitions"].items(exactly=len(cells))),
        start=entry["start"].numbers(2 + axes),
        goal_pose=entry["goal_pose"].numbers(3),
        goal_joints=tuple(None if goal.value is None else goal.number() for goal in goals),
        joint_names=names,
        margin=entry["margin"].number(at_least=0.0),
        gain_set=entry["gain_set"].text(),
        problem=entry["problem"].text(),
    )


def _cell(entry: Entry, axes: int) -> Cell:
    fields = entry.fields("lower", "upper", "safe", "core", "tidied")
    lower, upper = _interval(fields["lower"], fields["upper"], axes)
    return Cell(fields["safe"].polygon(), fields["core"].polygon(), fields["tidied"].polygon(), lower, upper)


def _transition(entry: Entry, axes: int) -> Transition:
    fields = entry.fields(
        "target", "goal_lower", "goal_upper", "inradius", "neck", "length", "estimated_time", "only_angles",
        "gains", "goal_region",
    )  # fmt: skip
    lower, upper = _interval(fields["goal_lower"], fields["goal_upper"], axes)
    return Transition(
        target=fields["target"].numbers(2),
        goal_region=fields["goal_region"].polygon(),
        goal_lower=lower,
        goal_upper=upper,
        inradius=fields["inradius"].number(positive=True),
        neck=fields["neck"].number(positive=True),
        length=fields["length"].number(at_least=0.0),
        estimated_time=fields["estimated_time"].number(at_least=0.0),
        only_angles=fields["only_angles"].flag(),
        gains=_gains(fields["gains"], axes),
    )


def _gains(entry: Entry, axes: int) -> TransitionGains:
    fields = entry.fields(*TransitionGains.__dataclass_fields__)
    return TransitionGains(
        stiffness=fields["stiffness"].number(positive=True),
        damping=fields["damping"].number(positive=True),
        governor_gain=fields["governor_gain"].number(positive=True),
        smoothing=fields["smoothing"].number(at_least=0.0),
        funnel=fields["funnel"].one_of("exponential", "smooth"),
        decay_rate=fields["decay_rate"].numbers(axes, positive=True),
        log_gain=fields["log_gain"].numbers(axes, positive=True),
        position_gain=fields["position_gain"].number(positive=True),
        rate_gain=fields["rate_gain"].number(positive=True),
        energy_bound=fields["energy_bound"].numbers(axes, positive=True),
    )


def _interval(lower: Entry, upper: Entry, axes: int) -> tuple[FloatArray, FloatArray]:
    """Two ends per axis, the lower one below the upper one."""
    low, high = lower.numbers(axes), upper.numbers(axes)
    gap = np.min(high - low, initial=inf)
    if gap <= 0.0:
        axis = int(np.argmin(high - low))
        raise PlanError(
            f"{upper.file}: {upper.key}[{axis}]: {high[axis]} is not allowed; expected more than "
            f"{lower.key}[{axis}], {low[axis]}"
        )
    return low, high
