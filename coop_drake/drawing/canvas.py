"""Blank figures, captions and legends, drawn without pyplot's global state."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from coop_drake.drawing.colours import GREY
from coop_drake.files import write_atomically

__all__ = ["house_style", "legend_above", "new_figure", "save_figure"]

_STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "lines.solid_joinstyle": "round",
}


def house_style() -> AbstractContextManager[None]:
    """Return a context in which figures are drawn in the common style; it ends with the old one."""
    return mpl.rc_context(_STYLE)


def new_figure(width: float, height: float, caption: str) -> Figure:
    """Return an empty figure of ``width`` by ``height`` inches with its caption underneath."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    figure.supxlabel(fill(caption, int(15 * width)), fontsize=9, x=0.02, ha="left", color=GREY)
    return figure


def legend_above(ax: Axes, handles: list[Patch] | None = None) -> None:
    """Put the legend in one row above the axes, where it hides nothing."""
    entries = handles if handles is not None else ax.get_legend_handles_labels()[0]
    ax.legend(
        handles=entries, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(entries), borderpad=0.1
    )


def save_figure(figure: Figure, path: Path, *, dpi: float = 150) -> None:
    """Write a figure as PNG of ``dpi`` points per inch, or as SVG if the path ends so; whole or not at all.

    The same figure gives the same bytes.
    """
    kind = "svg" if path.suffix == ".svg" else "png"
    metadata = {"Date": None} if kind == "svg" else None
    with mpl.rc_context({"svg.hashsalt": "coop_drake"}):
        write_atomically(path, lambda file: figure.savefig(file, dpi=dpi, format=kind, metadata=metadata))
