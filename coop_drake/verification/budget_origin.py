"""Whose budget a plan states: the required one, that of the scenario's deployment, or another one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.errors import RefusalError, shortened
from coop_drake.tree.component_tree import Bodies
from coop_drake.verification.checks import Check

SAME = 1e-9
"""Numbers that are computed twice differ by less, relative and absolute [kg, kg m^2, m, s, -]."""

NOT_THE_SCENARIOS = "the budget is not the scenario's"
"""How the check of another budget begins."""


@dataclass(frozen=True)
class Facts:
    """What is no departure, but a fact about the team or its actuators.

    Attributes:
        bodies: The team's bodies, as in a budget.
        bases: The frames of its bases, likewise.
        rotors: What its rotor adds to every joint's inertia, shape (n,) [kg m^2 or kg].
        dampings: Damping of every joint, shape (n,) [N m s or N s/m].
        limits: The scenario's limits of efforts by their names in a budget, None for no limit [N, N m].
    """

    bodies: Bodies
    bases: tuple[tuple[float, ...], ...]
    rotors: tuple[float, ...]
    dampings: tuple[float, ...]
    limits: Mapping[str, float | None]


@dataclass(frozen=True)
class OwnBudgets:
    """What a scenario's section ``deployment`` and its models give for budgets.

    Attributes:
        by_name: The budgets of the section, ``all`` and ``position``; empty where no budget counts what
            stands there.
        missing: Why one is missing, in words.
        facts: What every budget must have in common with the scenario.
    """

    by_name: Mapping[str, Budget]
    missing: str
    facts: Facts


@dataclass(frozen=True)
class ScenarioBudgets:
    """What a scenario says about budgets.

    Attributes:
        required: Name of the budget under which every plan shall hold; ``none`` where there is none.
        derive: Returns what follows from the section and the models, which are read for plans with a budget.
    """

    required: str
    derive: Callable[[], OwnBudgets]


def check_origin(budget: Budget | None, scenario: ScenarioBudgets) -> Check | None:
    """Say whose budget a plan has; None where neither plan nor scenario has one.

    A budget that is not the scenario's is accepted where none is required, but not with other masses than
    the team's or larger efforts than its actuators': they are no departures, but facts. It may leave out the
    bodies where no effort is limited; ``axis_error`` then has to count their part.

    Args:
        budget: What the plan states.
        scenario: What its scenario says.

    Raises:
        RefusalError: Names the entry, and what it should be.
    """
    asked = f"`deployment.budget: {scenario.required}`"
    if budget is None and scenario.required == "none":
        return None
    if budget is None:
        raise RefusalError("budget", f"is missing; the scenario requires {asked}")
    team = scenario.derive()
    if scenario.required != "none":
        if different := _difference(budget, team.by_name[scenario.required]):
            raise RefusalError(f"budget.{different[0]}", f"{different[1]} for {asked}")
        return Check(f"the budget is the one that the scenario requires, {scenario.required}", 1)
    for name, own in team.by_name.items():
        if not _difference(budget, own):
            return Check(f"the budget is that of the scenario's deployment, {name}", 1)
    if wrong := wrong_facts(budget, team.facts):
        raise RefusalError(f"budget.{wrong[0]}", f"is {shortened(getattr(budget, wrong[0]))}, not {wrong[1]}")
    away = _difference(budget, team.by_name["all"]) if "all" in team.by_name else None
    why = team.missing if away is None else " ".join(away)
    left_out = "; it leaves out the masses of the team" if budget.axes and not budget.bodies else ""
    return Check(f"{NOT_THE_SCENARIOS}: {why}{left_out}", 0)


def wrong_facts(budget: Budget, facts: Facts) -> tuple[str, str] | None:
    """Return a field of a budget that is not as the facts are, and what is allowed; None if all are.

    Bodies may be left out, with all that belongs to them; what is zero may be left out, too.
    """
    if budget.bodies and not _same(budget.bodies, facts.bodies):
        return "bodies", f"the team's, {shortened(facts.bodies)}, or none"
    if budget.bases and not _same(budget.bases, facts.bases):
        return "bases", f"the team's, {shortened(facts.bases)}, or none"
    for name in ("rotors", "dampings"):
        own = getattr(facts, name)
        nothing = (0.0,) * len(own)
        if not _same(getattr(budget, name) or nothing, due := own if budget.bodies else nothing):
            return name, f"those of the team's bodies, {list(due)}"
    for name, limit in facts.limits.items():
        stated = getattr(budget, name)
        if limit is not None and (stated is None or stated > limit):
            return name, f"at most {limit:g}, which the scenario's actuators can give"
    return None


def _difference(stated: Budget, expected: Budget) -> tuple[str, str] | None:
    """Return the first field in which two budgets differ, and how; None where they are the same."""
    for field in fields(Budget):
        found, due = getattr(stated, field.name), getattr(expected, field.name)
        if not _same(found, due):
            return field.name, f"is {shortened(found)}; the scenario gives {shortened(due)}"
    return None


def _same(found: Any, due: Any) -> bool:
    """Whether two values of a field are the same up to rounding: numbers, rows of them, truths or null."""
    if found is None or due is None or isinstance(found, bool | str):
        return bool(found == due)
    one, other = np.asarray(found, dtype=float), np.asarray(due, dtype=float)
    return one.shape == other.shape and bool(np.allclose(one, other, rtol=SAME, atol=SAME))
