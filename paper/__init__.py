"""The report of the paper: its Tables 1-2 and Figures 3-13 from our runs, beside what it states."""

from paper.comparison import GainFigures, compare_gains
from paper.corridor import corridor_plan, corridor_scenario
from paper.errata_figure import write_errata_figure
from paper.exhibits import Agreement, Exhibit, Statement
from paper.material import Material, gather
from paper.pages import write_report
from paper.report import exhibits
from paper.slice_figure import slice_figure
from paper.table_1 import CORRECTED, PRINTED

__all__ = [
    "CORRECTED",
    "PRINTED",
    "Agreement",
    "Exhibit",
    "GainFigures",
    "Material",
    "Statement",
    "compare_gains",
    "corridor_plan",
    "corridor_scenario",
    "exhibits",
    "gather",
    "slice_figure",
    "write_errata_figure",
    "write_report",
]
