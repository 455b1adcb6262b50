"""The figures of a report as SVG that stands inside a page, with text in the page's colour."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from coop_drake.campaign.report.bisections import is_determined, is_good, multiple_shown
from coop_drake.campaign.report.columns import MEASURES, SHARE, Measure
from coop_drake.campaign.report.distributions import Distribution, Group
from coop_drake.campaign.report.questions import ALL, Questions
from coop_drake.campaign.report.searches import Searched
from coop_drake.campaign.search.findings import BreakingPoint
from coop_drake.drawing.canvas import house_style, picture_of
from coop_drake.drawing.colours import BLUE, GREEN, GREY, INK, ORANGE, VERMILLION

_PANEL, _ROW = 2.3, 0.42
"""Width of a panel and height of one of its rows [in]: four panels fill a page of 1,000 points."""

_LABELS = 1.9
"""Space for the names of the rows [in]."""

_BELOW = 0.9
"""Space for numbers and names below a panel [in]."""

_LEAST = 0.5
"""Where the logarithmic scale of multiples begins [-]."""

_WORDS = 34
"""Letters in a line below a panel."""

_FROM, _USUAL, _WORST = "random departures", "usual find", "worst find"
_MOST, _MEDIAN, _LARGEST = "5 % to 95 %", "median", "largest"
"""What the marks of two figures mean."""


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


def searches_svg(searched: Sequence[Searched]) -> str:
    """Draw from where to where searches drove each margin; empty without searches."""
    shown = [one for one in MEASURES if any(one.name == row.margin for row in searched)]
    if not shown:
        return ""
    names = list(dict.fromkeys(f"{row.scenario}, {row.tier}" for row in searched))
    figure, panels = _panels(len(shown), len(names), names, width=5.0 / len(shown), row=0.3, top=0.4)
    for ax, measure in zip(panels, shown, strict=True):
        for row in (one for one in searched if one.margin == measure.name):
            place = len(names) - 1 - names.index(f"{row.scenario}, {row.tier}") + 0.35
            ends = measure.factor * np.array([row.before, row.typical, row.worst.worst])
            ax.plot(ends, [place] * 3, color=GREY, linewidth=1.0)
            ax.plot(ends[0], place, "o", color=GREY, markersize=4.5, label=_FROM)
            ax.plot(ends[1], place, "o", color=BLUE, markersize=4.5, label=_USUAL)
            colour = VERMILLION if _is_beyond(measure, row.worst.worst) else ORANGE
            ax.plot(ends[2], place, "D", color=colour, markersize=5.0, label=_WORST)
        _limit(ax, measure)
    _legend(figure, panels[0])
    return _svg(figure)


def _legend(figure: Figure, ax: Axes) -> None:
    """Say above the panels what the marks are, each once."""
    marks = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    figure.legend(marks.values(), marks.keys(), loc="upper center", ncols=len(marks), frameon=False)


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


def breaking_svg(points: Sequence[BreakingPoint]) -> str:
    """Draw up to which multiple of what is certified no run was lost: dots for scenarios, a bar to the least.

    Empty without points; those that are not determined are left out.
    """
    points = [point for point in points if is_determined(point)]
    if not points:
        return ""
    names = list(dict.fromkeys(point.departure for point in points))
    figure, (ax,) = _panels(1, len(names), [name.replace("_", " ") for name in names], width=5.0)
    for place, name in zip(np.arange(len(names))[::-1] + 0.35, names, strict=True):
        own = sorted((point for point in points if point.departure == name), key=lambda point: point.kept)
        ends = [max(point.kept, _LEAST) for point in own]
        ax.barh(place, ends[0], height=0.5, color=GREEN if is_good(own[0]) else VERMILLION)
        ax.plot(ends, [place] * len(ends), "o", color=BLUE, markersize=4.5)
        text = f"{multiple_shown(own[0])}, {own[0].scenario}"
        ax.annotate(
            text, (ends[-1], place), (8.0, 0.0), textcoords="offset points", va="center", parse_math=False
        )
    ax.axvline(1.0, color=INK, linewidth=1.5)
    most = max(point.kept for point in points)
    largest = int(np.ceil(np.log2(max(2.0, most)))) + 1
    ax.set_xscale("log", base=2)
    ax.set_xlim(_LEAST, 2.0 ** (largest + 1.8))
    ticks = 2.0 ** np.arange(-1, largest + 1)
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set_xlabel("largest multiple of what is certified at which no run was lost [-]")
    return _svg(figure)


def growth_svg(questions: Sequence[Questions]) -> str:
    """Draw the planner's CPU time in every group of questions; empty without answers."""
    groups = [one for one in questions if one.axis != ALL and one.seconds.count]
    if not groups:
        return ""
    names = [f"{one.axis} {one.group}" for one in groups]
    figure, (ax,) = _panels(1, len(groups), names, width=5.0, row=0.24, top=0.4)
    places = np.arange(len(groups))[::-1] + 0.35
    for place, one in zip(places, groups, strict=True):
        times = one.seconds
        ax.plot([times.low, times.high], [place, place], color=BLUE, alpha=0.45, linewidth=5.0, label=_MOST)
        ax.plot(times.median, place, "o", color=BLUE, markersize=4.5, label=_MEDIAN)
        ax.plot(times.largest, place, "D", color=ORANGE, markersize=5.0, label=_LARGEST)
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_xlabel("CPU time of an answer [s]")
    _legend(figure, ax)
    return _svg(figure)


def _panels(
    count: int,
    rows: int,
    names: Sequence[str],
    *,
    width: float = _PANEL,
    row: float = _ROW,
    top: float = 0.1,
) -> tuple[Figure, list[Axes]]:
    with house_style():
        size = (_LABELS + count * width, rows * row + _BELOW + top)
        figure = Figure(figsize=size)
        FigureCanvasAgg(figure)
        axes = list(figure.subplots(1, count, sharey=True, squeeze=False)[0])
        edges = _LABELS / size[0], _BELOW / size[1], 0.99, 1.0 - top / size[1]
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
