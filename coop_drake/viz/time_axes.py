"""Axes over the time of a run: stacked panels, marks where the next cell is entered, lines broken there."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from coop_drake.answers.log import SimulationLog
from coop_drake.drawing.canvas import DPI, set_margins
from coop_drake.drawing.colours import GREY
from coop_drake.tree.pose import FloatArray

_WIDTH = 7.5
"""Width of a figure [in]: that of a page of text."""

_MARGINS = (0.82, 0.15, 0.32)
"""Space at the left for tick labels and an axis label, at the right, and at the top for a legend [in]."""

_SINGLE, _SEVERAL = 2.7, 1.8
"""Height of the panel of a figure that has only one, and of one among several [in]."""

_GAP = 0.28
"""Space between two panels [in]: a legend fits."""

_TICKED = (0.0, 8.5)
"""Limits of axes that are made ahead, in any unit: they get nine ticks, the most that an axis has."""


class TimeAxes:
    """Makes figures with panels over a common axis of time.

    Some can be made ahead, before there is a log: most of the time that it takes to draw a curve goes into
    ticks, which a figure makes when it is drawn first.

    Args:
        counts: Of every figure that is made ahead its number of panels.
    """

    def __init__(self, counts: Iterable[int] = ()) -> None:
        self._ahead = [(count, *_blank(count)) for count in counts]
        for _, figure, axes in self._ahead:
            for ax in axes:
                ax.set(xlim=_TICKED, ylim=_TICKED)
            figure.set_dpi(DPI)
            figure.canvas.draw()
            for ax in axes:
                ax.set_autoscale_on(True)

    def __call__(
        self,
        log: SimulationLog,
        caption: str,
        labels: list[str],
        *,
        height: float | None = None,
        switches: bool = True,
    ) -> tuple[Figure, list[Axes]]:
        """Return a figure with one panel per label, stacked over the axis of time, each of some height [in].

        A dashed vertical line marks every switch to the next cell, and the caption says so, unless
        ``switches`` is false.
        """
        count = len(labels)
        height = height or (_SINGLE if count == 1 else _SEVERAL)
        if switches:
            caption = f"{caption} Dashed lines mark the switches from cell to cell."
        figure, axes = self._taken(count) or _blank(count)
        figure.set_size_inches(_WIDTH, count * (height + _GAP) + 1.0)
        set_margins(figure, caption, _MARGINS)
        figure.subplots_adjust(hspace=_GAP / height)
        marked = log.times[1:][np.diff(log.cell_index) != 0] if switches else []
        for ax, label in zip(axes, labels, strict=True):
            ax.set_ylabel(label)
            ax.vlines(
                marked,
                0.0,
                1.0,
                transform=ax.get_xaxis_transform(),
                colors=GREY,
                linewidths=0.5,
                linestyles=(0, (4, 3)),
                zorder=0.5,
            )
        axes[0].set_xlim(0.0, max(float(log.times[-1]), 1e-9))
        axes[-1].set_xlabel("time [s]")
        return figure, list(axes)

    def _taken(self, count: int) -> tuple[Figure, list[Axes]] | None:
        """A figure that was made ahead, if there is one with so many panels; each is used once."""
        found = next((entry for entry in self._ahead if entry[0] == count), None)
        if found is None:
            return None
        self._ahead.remove(found)
        return found[1], found[2]


def _blank(count: int) -> tuple[Figure, list[Axes]]:
    """A figure with so many empty panels over a common axis."""
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])


def break_at_switches(log: SimulationLog, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a line that is broken at every switch, so that a jump is not drawn as a slope.

    Times [s] and values, shape (T,), get one more entry at every switch: a NaN before the new cell's first
    value.
    """
    places = np.flatnonzero(np.diff(log.cell_index)) + 1
    return np.insert(log.times, places, log.times[places]), np.insert(values.astype(float), places, np.nan)
