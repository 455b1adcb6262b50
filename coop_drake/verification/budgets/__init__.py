"""Check that a plan tolerates the budget that it states, with the law written again and in another form."""

from coop_drake.verification.budgets.check import check_budget
from coop_drake.verification.budgets.origin import (
    NOT_THE_SCENARIOS,
    OwnBudgets,
    ScenarioBudgets,
    check_origin,
    wrong_masses,
)
from coop_drake.verification.budgets.position import check_position

__all__ = [
    "NOT_THE_SCENARIOS",
    "OwnBudgets",
    "ScenarioBudgets",
    "check_budget",
    "check_origin",
    "check_position",
    "wrong_masses",
]
