from .log import SimulationLog
from .plan import (
    BeyondLimits,
    Cell,
    Found,
    Infeasible,
    Plan,
    PlanningResult,
    SearchReport,
    Transition,
    Undecided,
    load_plan,
    save_plan,
    table_1,
)
from .problem import PlannerSettings, PlanningProblem

__all__ = [
    "BeyondLimits",
    "Cell",
    "Found",
    "Infeasible",
    "Plan",
    "PlannerSettings",
    "PlanningProblem",
    "PlanningResult",
    "SearchReport",
    "SimulationLog",
    "Transition",
    "Undecided",
    "load_plan",
    "save_plan",
    "table_1",
]
