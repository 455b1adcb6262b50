"""Axes over time: stacked ones, marks at the switches to the next cell, lines that break there."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from coop_drake.drawing.canvas import new_figure
from coop_drake.drawing.colours import GREY
from coop_drake.simulation.log import IntArray
from coop_drake.tree.pose import FloatArray

__all__ = ["SWITCHES", "break_at", "mark_switches", "switch_times", "time_axes"]

SWITCHES = "Dashed lines mark the switches from cell to cell."
"""What a caption says of `mark_switches`."""


def time_axes(caption: str, labels: list[str], *, height: float = 2.1) -> tuple[Figure, list[Axes]]:
    """Return a figure with one axes per label, stacked over a common time axis in seconds."""
    figure = new_figure(7.5, 0.9 + height * len(labels), caption)
    axes = figure.subplots(len(labels), 1, sharex=True, squeeze=False)[:, 0]
    for ax, label in zip(axes, labels, strict=True):
        ax.set_ylabel(label)
        ax.ticklabel_format(useOffset=False)
    axes[-1].set_xlabel("time [s]")
    return figure, list(axes)


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
