"""The figures of a report as SVG that stands inside a page, with text in the page's colour."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from coop_drake.campaign.report.columns import MEASURES, Measure
from coop_drake.campaign.report.distributions import Distribution, Group
from coop_drake.campaign.report.questions import ALL, Questions
from coop_drake.campaign.search.findings import BreakingPoint
from coop_drake.drawing.canvas import house_style, picture_of
from coop_drake.drawing.colours import BLUE, GREEN, GREY, INK, ORANGE, VERMILLION

_PANEL, _ROW = 2.3, 0.42
"""Width of a panel and height of one of its rows [in]: four panels fill a page of 1,000 points."""

_LABELS = 1.9
"""Space for the names of the rows [in]."""


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
        ax.set_xlabel(f"{measure.label}\n[{measure.unit}]")
        if measure.margin:
            ax.axvline(0.0, color=VERMILLION, linewidth=1.5)
            ax.set_xlim(left=min(0.0, ax.get_xlim()[0]))
        else:
            ax.set_xlim(left=0.0)
    return _svg(figure)


def breaking_svg(points: Sequence[BreakingPoint]) -> str:
    """Draw up to which multiple of what is certified no run was lost; empty without points."""
    if not points:
        return ""
    names = [f"{point.departure.replace('_', ' ')}, {point.scenario}" for point in points]
    figure, (ax,) = _panels(1, len(points), names, width=5.0)
    ends = np.array([max(point.kept, 0.5) for point in points])  # the scale is logarithmic from one half
    places = np.arange(len(points))[::-1] + 0.35
    ax.barh(places, ends, height=0.5, color=[GREEN if end >= 1.0 else VERMILLION for end in ends])
    for place, point in zip(places, points, strict=True):
        beyond = "" if np.isfinite(point.lost) else " or more"
        text = f"{point.kept:.2g}{beyond}"
        ax.annotate(text, (max(point.kept, 0.5), place), (5.0, 0.0), textcoords="offset points", va="center")
    ax.axvline(1.0, color=INK, linewidth=1.5)
    largest = int(np.ceil(np.log2(max(2.0, ends.max())))) + 1
    ax.set_xscale("log", base=2)
    ax.set_xlim(0.5, 2.0 ** (largest + 0.8))
    ticks = 2.0 ** np.arange(-1, largest + 1)
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set_xlabel("largest multiple of what is certified at which no run was lost [-]")
    return _svg(figure)


def growth_svg(questions: Sequence[Questions]) -> str:
    """Draw the planner's CPU time in every group of questions; empty without questions."""
    groups = [one for one in questions if one.axis != ALL]
    if not groups:
        return ""
    names = [f"{one.axis} {one.group}" for one in groups]
    figure, (ax,) = _panels(1, len(groups), names, width=5.0, row=0.24)
    places = np.arange(len(groups))[::-1] + 0.35
    for place, one in zip(places, groups, strict=True):
        times = one.seconds
        ax.plot([times.low, times.high], [place, place], color=BLUE, alpha=0.45, linewidth=5.0)
        ax.plot(times.median, place, "o", color=BLUE, markersize=4.5)
        ax.plot(times.largest, place, "D", color=ORANGE, markersize=5.0)
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_xlabel("CPU time of an answer [s]")
    return _svg(figure)


def _panels(
    count: int, rows: int, names: Sequence[str], *, width: float = _PANEL, row: float = _ROW
) -> tuple[Figure, list[Axes]]:
    with house_style():
        size = (_LABELS + count * width, rows * row + 1.0)
        figure = Figure(figsize=size)
        FigureCanvasAgg(figure)
        axes = list(figure.subplots(1, count, sharey=True, squeeze=False)[0])
        figure.subplots_adjust(_LABELS / size[0], 0.68 / size[1], 0.99, 1.0 - 0.1 / size[1], wspace=0.12)
        axes[0].set_yticks(np.arange(rows)[::-1] + 0.35, names)
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
    lost = measure.margin and worst <= 0.0
    ax.plot(measure.factor * worst, base, "D", color=VERMILLION if lost else ORANGE, markersize=5.0)


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
