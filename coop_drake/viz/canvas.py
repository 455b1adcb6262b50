"""Blank figures, time axes and captions, drawn without pyplot's global state."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from coop_drake.files import write_atomically
from coop_drake.geometry.pose import FloatArray
from coop_drake.simulation.log import IntArray
from coop_drake.viz.colours import GREY

__all__ = [
    "break_at",
    "house_style",
    "legend_above",
    "mark_switches",
    "new_figure",
    "save_figure",
    "switch_times",
    "time_axes",
]

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


def time_axes(caption: str, labels: list[str], *, height: float = 2.1) -> tuple[Figure, list[Axes]]:
    """Return a figure with one axes per label, stacked over a common time axis in seconds."""
    figure = new_figure(7.5, 0.9 + height * len(labels), caption)
    axes = figure.subplots(len(labels), 1, sharex=True, squeeze=False)[:, 0]
    for ax, label in zip(axes, labels, strict=True):
        ax.set_ylabel(label)
        ax.ticklabel_format(useOffset=False)
    axes[-1].set_xlabel("time [s]")
    return figure, list(axes)


def legend_above(ax: Axes, handles: list[Patch] | None = None) -> None:
    """Put the legend in one row above the axes, where it hides nothing."""
    entries = handles if handles is not None else ax.get_legend_handles_labels()[0]
    ax.legend(
        handles=entries, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(entries), borderpad=0.1
    )


def switch_times(times: FloatArray, cell_index: IntArray) -> FloatArray:
    """Return the times [s] at which the team enters the next cell."""
    switches: FloatArray = times[1:][np.diff(cell_index) != 0]
    return switches


def mark_switches(axes: list[Axes], switches: FloatArray) -> None:
    """Draw a thin dashed vertical line at every switch to the next cell."""
    for ax in axes:
        for time in switches:
            ax.axvline(float(time), color=GREY, linewidth=0.5, linestyle=(0, (4, 3)), zorder=0.5)


def break_at(times: FloatArray, values: FloatArray, cell_index: IntArray) -> tuple[FloatArray, FloatArray]:
    """Break a line at every switch, so that a jump is not drawn as a slope.

    Args:
        times: Sample times [s], shape (T,).
        values: Values, shape (T,).
        cell_index: Cell of each sample, shape (T,).

    Returns:
        Times and values with a NaN inserted before the first sample of each new cell.
    """
    places = np.flatnonzero(np.diff(cell_index)) + 1
    return np.insert(times, places, times[places]), np.insert(values.astype(float), places, np.nan)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG; an interrupted write leaves no file behind."""
    write_atomically(path, lambda file: figure.savefig(file, dpi=150, format="png"))
