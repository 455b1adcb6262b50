"""The file ``plan.json``, and to which question a plan belongs; every number has full precision."""

from __future__ import annotations

from math import isclose, remainder, tau
from pathlib import Path
from typing import Any

import numpy as np
from shapely import Point

from coop_drake.answers.digest import content_digest, problem_digest
from coop_drake.answers.document import Document, write_document
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import PlanError
from coop_drake.laws.gains import GainSet, ScheduledGains
from coop_drake.typed_data import to_plain

# The file ``plan.json``: the same bytes for the same plan, every number at full precision.

FORMAT = "coop_drake plan"
"""What the document says it is."""

VERSION = 5
"""Version of its layout; another one is refused."""

OTHERWISE_LONG = ("effort", "alarm_times", "alarm", "ahead_alarm")
"""Lists of a transition that have another number of entries than there are axes."""


def save_plan(plan: Plan, path: Path | str) -> Path:
    """Write a plan so that ``load_plan`` gives the same plan back, and saving that the same bytes.

    The file is written whole or not at all; its path is returned.
    """
    return write_document(path, plan_document(plan), rows=("cells", "transitions"))


def plan_digest(plan: Plan) -> str:
    """Return the digest that ``save_plan`` writes into a plan's file."""
    return content_digest(plan_document(plan))


def plan_document(plan: Plan) -> dict[str, Any]:
    """The content of a plan's file without its digest, as plain data."""
    return {"format": FORMAT, "version": VERSION, **to_plain(plan, Plan)}


def load_plan(path: Path | str) -> Plan:
    """Read a plan that can be executed from a file that ``save_plan`` wrote.

    Raises:
        PlanError: If it is not such a plan: names the file, the key, the value and what is allowed there.
    """
    document = Document.load(path, "a plan")
    plan = read_plan(document)
    check_plan(plan, document.file)
    document.check_digest()
    if plan.refused_by:
        limits = "; ".join(refusal.describe() for refusal in plan.refused_by)
        document.refuse(
            "refused_by",
            limits,
            "no limit that a plan breaks; with other limits `plan` may find one that can be carried out",
        )
    return plan


def read_plan(document: Document) -> Plan:
    """Read a plan from a document; every key, length and number is checked, but not what they mean together.

    Raises:
        PlanError: Names the file, the key, the value and what is allowed there.
    """
    document.check_entry("format", FORMAT)
    document.check_entry("version", VERSION)
    plan = document.read(Plan, head=("format", "version"))
    axes = 1 + len(plan.joint_names)
    if not plan.cells:
        document.refuse("cells", [], "at least one cell")
    document.check_length("start", 2 + axes)
    document.check_length("goal_pose", 3)
    document.check_length("goal_joints", axes - 1)
    document.check_length("transitions", len(plan.cells))
    for k in range(len(plan.cells)):
        document.check_intervals(f"cells[{k}].", axes)
        document.check_intervals(f"transitions[{k}].goal_", axes)
        document.check_length(f"transitions[{k}].target", 2)
        gains = document.entry(f"transitions[{k}].gains")
        parts = {"gains": gains, "gains.rest": gains.get("rest")}
        parts["tolerance"] = document.entry(f"transitions[{k}]").get("tolerance")
        for part, content in parts.items():
            for name, value in (content or {}).items():
                if isinstance(value, list) and name not in OTHERWISE_LONG:
                    document.check_length(f"transitions[{k}].{part}.{name}", axes)
        if parts["tolerance"] is not None:
            _check_levels(document, f"transitions[{k}].tolerance", axes)
    return plan


def _check_levels(document: Document, where: str, axes: int) -> None:
    """Refuse levels of axes that are not as many as the stages and the axes."""
    times = document.entry(f"{where}.alarm_times")
    if not times:
        document.refuse(f"{where}.alarm_times", times, "at least one time")
    for name in ("alarm", "ahead_alarm"):
        document.check_length(f"{where}.{name}", len(times))
        for i in range(len(times)):
            document.check_length(f"{where}.{name}[{i}]", axes)


# What every executable plan satisfies: targets shared by neighbours, goals inside slices.

ROUNDING = 1e-9
"""Regions and intervals that share a boundary may differ by so much [m, rad]."""


def check_plan(plan: Plan, file: str) -> None:
    """Refuse a plan that could not be executed safely.

    Raises:
        PlanError: Names the file that it comes from, the key and what is allowed.
    """
    _check_ends(plan, file)
    for k in range(len(plan.cells)):
        for m in range(k, min(k + 2, len(plan.cells))):
            _check_handover(plan, k, m, file)


def _check_handover(plan: Plan, k: int, m: int, file: str) -> None:
    """Transition k must end inside cell m, its own or the next one."""
    transition, cell = plan.transitions[k], plan.cells[m]
    if not plan.governed(m).contains(Point(transition.target)):
        region = "cells[{}].tidied" if plan.transitions[m].governed is None else "transitions[{}].governed"
        raise PlanError(
            f"{file}: transitions[{k}].target: {transition.target.tolist()} is not allowed; expected a point "
            f"inside {region.format(m)}"
        )
    inside = (cell.lower - ROUNDING <= transition.goal_lower) & (
        transition.goal_upper <= cell.upper + ROUNDING
    )
    if not inside.all():
        axis = int(np.argmin(inside))
        interval = [float(transition.goal_lower[axis]), float(transition.goal_upper[axis])]
        raise PlanError(
            f"{file}: transitions[{k}].goal_lower, goal_upper: axis {axis}: {interval} is not allowed; "
            f"expected an interval inside cells[{m}]'s [{cell.lower[axis]}, {cell.upper[axis]}]"
        )


def _check_ends(plan: Plan, file: str) -> None:
    first, start = plan.cells[0], plan.start
    if not first.tidied.contains(Point(start[:2])) or not _holds(first.lower, start[2:], first.upper):
        raise PlanError(
            f"{file}: start: {start.tolist()} is not allowed; expected a configuration in cells[0]"
        )


def _holds(lower: np.ndarray, values: np.ndarray, upper: np.ndarray) -> bool:
    return bool(((lower - ROUNDING <= values) & (values <= upper + ROUNDING)).all())


# Whether a plan was made for a planning problem, and for the age of a team's commands.

_SAME_GOAL = 1e-9
"""Difference of goals that rounding explains: an unwrapped angle may be turned by whole turns [m, rad]."""


def check_plan_belongs(plan: Plan, problem: PlanningProblem, path: Path) -> None:
    """Refuse a plan, read from the file at ``path``, that was made for another problem.

    Raises:
        PlanError: Names the first key in which they differ, its value, and the scenario's.
    """
    away = plan.goal_pose - problem.goal_pose
    away[2] = remainder(away[2], tau)
    same_goal = same_goal_joints(plan, problem) and np.abs(away).max() <= _SAME_GOAL
    names = tuple(joint.name for joint in problem.tree.joints)
    digest = problem_digest(problem)
    checks = (
        ("joint_names", plan.joint_names == names, _listed(plan.joint_names), _listed(names), ""),
        ("start", np.array_equal(plan.start, problem.start), plan.start.tolist(), problem.start.tolist(), ""),
        ("goal_pose", same_goal, *(_goal(question) for question in (plan, problem)), ""),
        (
            "problem",
            plan.problem == digest,
            repr(plan.problem),
            repr(digest),
            ": the plan was made for another floor, team or tolerance",
        ),
    )
    for key, same, found, expected, reason in checks:
        if not same:
            raise PlanError(
                f"{path}: {key}: {found} is not allowed; expected the scenario's, {expected}{reason}"
            )


def same_goal_joints(plan: Plan, problem: PlanningProblem) -> bool:
    """Whether a plan ends at the problem's values of the joints, those without limits modulo whole turns."""
    if len(plan.goal_joints) != len(problem.goal_joints):
        return False
    goals = zip(problem.tree.joints, plan.goal_joints, problem.goal_joints, strict=True)
    return all(
        abs(remainder(ours - theirs, tau)) <= _SAME_GOAL
        if joint.circular and ours is not None and theirs is not None
        else ours == theirs
        for joint, ours, theirs in goals
    )


def other_age(plan: Plan, gain_set: GainSet | None) -> str:
    """Say that a plan's gains are for another age of commands than the gain set's; empty where they are not.

    A plan belongs to its deployment: delay, control rate, losses and lag make commands older.

    Args:
        plan: The plan.
        gain_set: The scenario's gain set that the plan names; None where it has none.
    """
    if not isinstance(gain_set, ScheduledGains):
        return ""
    first = plan.transitions[0]
    factor = plan.age_factor * (1.0 if first.tolerance is None else first.tolerance.age_factor)
    expected = min(gain_set.age_phase / (factor * gain_set.age), gain_set.max_rate_gain)
    if isclose(first.gains.rate_gain, expected, rel_tol=_SAME_GOAL):
        return ""
    found = gain_set.age_phase / (factor * first.gains.rate_gain)
    return (
        f"its gains are for commands that rest on measurements {1e3 * found:.4g} ms old, and the "
        f"`deployment` and `control` of the scenario make these {1e3 * gain_set.age:.4g} ms old; "
        "`coop-drake plan` on this scenario makes the plan for it"
    )


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "no joint"


def _goal(question: Plan | PlanningProblem) -> str:
    return f"{question.goal_pose.tolist()} with goal_joints {list(question.goal_joints)}"
