"""Figures of the paper and Meshcat recordings of a run."""

from coop_drake.viz.figures import write_figures
from coop_drake.viz.table import table_1

__all__ = ["table_1", "write_figures"]
