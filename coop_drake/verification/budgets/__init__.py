"""Check that a plan tolerates the budget that it states, with the law written again and in another form."""

from coop_drake.verification.budgets.check import check_budget
from coop_drake.verification.budgets.efforts import check_efforts
from coop_drake.verification.budgets.origin import (
    NOT_THE_SCENARIOS,
    Facts,
    OwnBudgets,
    ScenarioBudgets,
    check_origin,
    wrong_facts,
)
from coop_drake.verification.budgets.position import check_position
from coop_drake.verification.budgets.restarting import check_restart

__all__ = [
    "NOT_THE_SCENARIOS",
    "Facts",
    "OwnBudgets",
    "ScenarioBudgets",
    "check_budget",
    "check_efforts",
    "check_origin",
    "check_position",
    "check_restart",
    "wrong_facts",
]
