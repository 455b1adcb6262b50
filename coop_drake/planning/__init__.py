"""From a problem to a plan: slices, cells, the cell graph, and the transitions that controllers follow."""

from coop_drake.planning.channel import Channel, FreeBox, NoChannel, SearchReport
from coop_drake.planning.estimate import plan_time
from coop_drake.planning.plan import Cell, Found, Infeasible, Plan, PlanningResult, Transition, Undecided
from coop_drake.planning.plan_file import load_plan, save_plan
from coop_drake.planning.problem import PlannerSettings, PlanningProblem
from coop_drake.planning.search import find_channel
from coop_drake.planning.table import table_1
from coop_drake.planning.transitions import make_plan, reschedule

__all__ = [
    "Cell",
    "Channel",
    "Found",
    "FreeBox",
    "Infeasible",
    "NoChannel",
    "Plan",
    "PlannerSettings",
    "PlanningProblem",
    "PlanningResult",
    "SearchReport",
    "Transition",
    "Undecided",
    "find_channel",
    "load_plan",
    "make_plan",
    "plan_time",
    "reschedule",
    "save_plan",
    "table_1",
]
