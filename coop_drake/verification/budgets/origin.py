"""Whose budget a plan states: the required one, that of the scenario's deployment, or another one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.errors import RefusalError, shortened
from coop_drake.tree.bodies import Bodies
from coop_drake.verification.checks import Check

SAME = 1e-9
"""Numbers that are computed twice differ by less, relative and absolute [kg, kg m^2, m, s, -]."""

NOT_THE_SCENARIOS = "the budget is not the scenario's"
"""How the check of another budget begins."""


@dataclass(frozen=True)
class OwnBudgets:
    """What a scenario's section ``deployment`` and its models give for budgets.

    Attributes:
        by_name: The budgets of the section, ``all`` and ``position``; empty where no budget counts what
            stands there.
        missing: Why it is empty, in words.
        bodies: The team's bodies, as in a budget.
        rotors: What its rotor adds to every joint's inertia, shape (n,) [kg m^2 or kg].
        moved_mass: Largest mass that a robot moves [kg].
    """

    by_name: Mapping[str, Budget]
    missing: str
    bodies: Bodies
    rotors: tuple[float, ...]
    moved_mass: float


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
    the team's: they are no departures, but facts. It may leave out the bodies, whose part ``axis_error`` then
    has to count.

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
    if wrong := wrong_masses(budget, team.bodies, team.rotors, team.moved_mass):
        raise RefusalError(f"budget.{wrong[0]}", f"is {shortened(getattr(budget, wrong[0]))}, not {wrong[1]}")
    away = _difference(budget, team.by_name["all"]) if team.by_name else None
    why = team.missing if away is None else " ".join(away)
    left_out = "; it leaves out the masses of the team" if budget.axes and not budget.bodies else ""
    return Check(f"{NOT_THE_SCENARIOS}: {why}{left_out}", 0)


def wrong_masses(
    budget: Budget, bodies: Bodies, rotors: tuple[float, ...], moved_mass: float
) -> tuple[str, str] | None:
    """Return a field of a budget with masses that are not the team's, and what is allowed; None if all are.

    Bodies may be left out, with rotors; rotors may be left out where they add nothing. Arguments as in
    ``OwnBudgets``.
    """
    if budget.bodies and not _same(budget.bodies, bodies):
        return "bodies", f"the team's, {shortened(bodies)}, or none"
    due = rotors if budget.bodies else (0.0,) * len(rotors)
    if not _same(budget.rotors or (0.0,) * len(rotors), due):
        return "rotors", f"those of the team's bodies, {list(due)}"
    if budget.moved_mass is not None and not budget.moved_mass >= moved_mass * (1.0 - SAME):
        return "moved_mass", f"at least {moved_mass:.6g} kg, which a robot moves"
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
