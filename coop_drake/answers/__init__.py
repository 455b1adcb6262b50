"""What the planner is asked and what it answers, and how both are read and written."""

from coop_drake.answers.cell_table import table_1
from coop_drake.answers.plan import Cell, Found, Infeasible, Plan, PlanningResult, Transition, Undecided
from coop_drake.answers.plan_file import load_plan, save_plan
from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.answers.search_report import SearchReport

__all__ = [
    "Cell",
    "Found",
    "Infeasible",
    "Plan",
    "PlannerSettings",
    "PlanningProblem",
    "PlanningResult",
    "SearchReport",
    "Transition",
    "Undecided",
    "load_plan",
    "save_plan",
    "table_1",
]
