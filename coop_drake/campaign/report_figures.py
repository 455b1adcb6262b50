"""The figures of a report as SVG that stands inside a page, with text in the page's colour."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from coop_drake.campaign.report import MEASURES, SHARE, Distribution, Group, Measure
from coop_drake.drawing.canvas import house_style, picture_of
from coop_drake.drawing.colours import BLUE, GREY, INK, ORANGE, VERMILLION

_PANEL, _ROW = 2.3, 0.42
"""Width of a panel and height of one of its rows [in]: four panels fill a page of 1,000 points."""

_LABELS = 1.9
"""Space for the names of the rows [in]."""

_BELOW = 0.9
"""Space for numbers and names below a panel [in]."""

_ABOVE = 0.1
"""Space above a panel [in]."""

_WORDS = 34
"""Letters in a line below a panel."""


def distributions_svg(groups: Sequence[Group], measures: Sequence[Measure] = MEASURES) -> str:
    """Draw how the columns are distributed, one row for each scenario and tier; empty without numbers."""
    shown = [one for one in measures if any(one.name in group.measures for group in groups)]
    if not shown:
        return ""
    figure, panels = _panels(len(shown), len(groups), [f"{one.scenario}, {one.tier}" for one in groups])
    for ax, measure in zip(panels, shown, strict=True):
        for row, group in enumerate(groups):
            if (values := group.measures.get(measure.name)) is not None:
                _draw_hill(ax, len(groups) - 1 - row, values, measure)
        _limit(ax, measure)
    return _svg(figure)


def _limit(ax: Axes, measure: Measure) -> None:
    """Draw the limit of a measure that has one, and let the axis begin at zero."""
    words = textwrap.fill(measure.label, _WORDS)
    ax.set_xlabel(f"{words}\n[{measure.unit}]")
    if measure.margin or measure.name == SHARE:
        ax.axvline(0.0 if measure.margin else measure.factor, color=VERMILLION, linewidth=1.5)
    low, high = ax.get_xlim()
    ax.set_xlim(min(0.0, low) if measure.margin else 0.0, high + 0.02 * (high - low))


def _is_beyond(measure: Measure, value: float) -> bool:
    """Whether a value is beyond the limit of its measure."""
    return value <= 0.0 if measure.margin else measure.name == SHARE and value > 1.0


def _panels(count: int, rows: int, names: Sequence[str]) -> tuple[Figure, list[Axes]]:
    with house_style():
        size = (_LABELS + count * _PANEL, rows * _ROW + _BELOW + _ABOVE)
        figure = Figure(figsize=size)
        FigureCanvasAgg(figure)
        axes = list(figure.subplots(1, count, sharey=True, squeeze=False)[0])
        edges = _LABELS / size[0], _BELOW / size[1], 0.99, 1.0 - _ABOVE / size[1]
        figure.subplots_adjust(*edges, wspace=0.12)
        axes[0].set_yticks(np.arange(rows)[::-1] + 0.35, names, parse_math=False)
        for ax in axes:
            ax.set_ylim(-0.1, rows)
            ax.tick_params(axis="y", length=0)
            ax.spines["left"].set_visible(False)
            ax.grid(axis="y", visible=False)
            ax.locator_params(axis="x", nbins=5)
    return figure, axes


def _draw_hill(ax: Axes, base: float, values: Distribution, measure: Measure) -> None:
    """Draw a histogram above its row, a line over all values, and marks at the median and the worst one."""
    edges = measure.factor * np.linspace(values.least, values.largest, len(values.heights) + 1)
    tall = 0.7 * np.array(values.heights) / max(values.heights)
    if values.least < values.largest:
        ax.stairs(base + tall, edges, baseline=base, fill=True, color=BLUE, alpha=0.45, linewidth=0.0)
    ax.plot(edges[[0, -1]], [base, base], color=GREY, linewidth=1.0)
    ax.plot(measure.factor * values.median, base, "o", color=BLUE, markersize=4.5)
    worst = values.least if measure.margin else values.largest
    colour = VERMILLION if _is_beyond(measure, worst) else ORANGE
    ax.plot(measure.factor * worst, base, "D", color=colour, markersize=5.0)


def _svg(figure: Figure) -> str:
    """Return a figure as SVG without a background; its text is that of the page."""
    figure.patch.set_alpha(0.0)
    for ax in figure.axes:
        ax.patch.set_alpha(0.0)
    with mpl.rc_context({"svg.fonttype": "none", "text.color": INK}):
        text = picture_of(figure, ".svg").decode()
    text = text[text.index("<svg") :]
    for ink in (INK, "#000000", "black"):
        text = text.replace(f": {ink}", ": currentColor").replace(f'"{ink}"', '"currentColor"')
    return text
