"""What the paper reports, done again: its tables and figures from our runs, beside what it states."""

from coop_drake.reproduction.comparison import GainFigures, compare_gains
from coop_drake.reproduction.corridor import corridor_plan, corridor_scenario
from coop_drake.reproduction.errata_figure import write_errata_figure
from coop_drake.reproduction.exhibits import Exhibit, Statement, Verdict
from coop_drake.reproduction.material import Material, gather
from coop_drake.reproduction.pages import write_report
from coop_drake.reproduction.report import exhibits
from coop_drake.reproduction.table_1 import CORRECTED, PRINTED

__all__ = [
    "CORRECTED",
    "PRINTED",
    "Exhibit",
    "GainFigures",
    "Material",
    "Statement",
    "Verdict",
    "compare_gains",
    "corridor_plan",
    "corridor_scenario",
    "exhibits",
    "gather",
    "write_errata_figure",
    "write_report",
]
