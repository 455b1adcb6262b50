"""What the paper reports, played again: its Table 1 through the closed loop with both gain sets."""

from coop_drake.reproduction.comparison import GainFigures, compare_gains
from coop_drake.reproduction.corridor import corridor_plan, corridor_scenario
from coop_drake.reproduction.table_1 import CORRECTED, PRINTED

__all__ = [
    "CORRECTED",
    "PRINTED",
    "GainFigures",
    "compare_gains",
    "corridor_plan",
    "corridor_scenario",
]
