"""The figure of a search for gains: every trial by two criteria, and the best score so far."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from coop_drake.drawing.canvas import house_style, new_figure, save_figure
from coop_drake.drawing.colours import BLUE, GREY, INK, VERMILLION
from coop_drake.tuning import CRITERIA, Criterion, Search


def write_tuning_figure(found: Search, path: Path) -> Path:
    """Write the figure of a search as PNG."""
    with house_style():
        save_figure(tuning_figure(found), path)
    return path


def tuning_figure(found: Search) -> Figure:
    """Draw every run that arrived by the criterion sought and another, and the best score trial by trial."""
    sought = CRITERIA[max(found.objective.weights, key=lambda name: found.objective.weights[name])]
    other = CRITERIA["peak_force" if sought.name == "time" else "time"]
    failed = sum(not trial.outcome.arrived for trial in found.trials)
    caption = (
        f"Search for gains: {len(found.trials) - 1} runs of the whole transport besides the one before. "
        f"Left every run that arrived ({failed} did not); right the best score so far, 1 before."
    )
    figure = new_figure(9.5, 4.6, caption)
    plane, fall = figure.subplots(1, 2, width_ratios=(3, 2))
    _draw_trials(plane, found, other, sought)
    best = np.minimum.accumulate(found.scores)
    shown = np.logical_or.accumulate([found.objective.kept(trial.outcome) for trial in found.trials])
    fall.step(np.arange(len(best))[shown], best[shown], where="post", color=VERMILLION)
    fall.set_xlabel("run")
    fall.set_ylabel("best score so far [-]")
    return figure


def _draw_trials(ax: Axes, found: Search, across: Criterion, up: Criterion) -> None:
    objective = found.objective
    arrived = [trial.outcome for trial in found.trials if trial.outcome.arrived]
    kept = [outcome for outcome in arrived if objective.kept(outcome)]
    broke = [outcome for outcome in arrived if not objective.kept(outcome)]
    for outcomes, colour, label in ((broke, GREY, "breaks a limit"), (kept, BLUE, "keeps all limits")):
        points = np.array([(one.values[across.name], one.values[up.name]) for one in outcomes]).reshape(-1, 2)
        ax.plot(*points.T, "o", color=colour, markersize=4, alpha=0.7, markeredgewidth=0, label=label)
    before, best = objective.before, found.best.outcome.values
    ax.plot(before[across.name], before[up.name], "D", color=INK, markersize=7, label="before", zorder=5)
    ax.plot(best[across.name], best[up.name], "*", color=VERMILLION, markersize=15, label="chosen", zorder=6)
    for limit in objective.limits:
        if limit.criterion == across.name:
            ax.axvline(limit.bound(before), color=GREY, linestyle="--", linewidth=1.0, label="limit")
        elif limit.criterion == up.name:
            ax.axhline(limit.bound(before), color=GREY, linestyle="--", linewidth=1.0, label="limit")
    ax.set_xlabel(f"{across.label} [{across.unit}]")
    ax.set_ylabel(f"{up.label} [{up.unit}]")
    if _spread([outcome.values[up.name] for outcome in arrived]) > 5.0:
        ax.set_yscale("log")
        ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.yaxis.set_minor_formatter(NullFormatter())
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, 1.13), ncols=5, fontsize=8, columnspacing=1.0)


def _spread(values: Sequence[float]) -> float:
    """Largest over smallest; 1 where one is not positive."""
    return max(values) / min(values) if values and min(values) > 0.0 else 1.0
