"""Check that a plan tolerates the budget that it states, with the law written again and in another form."""

from coop_drake.verification.budgets.check import check_budget

__all__ = ["check_budget"]
