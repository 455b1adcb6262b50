"""The report of a campaign: rates with their bounds, distributions, the worst runs, as a page and as JSON."""

from __future__ import annotations

import json
import textwrap
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from decimal import ROUND_CEILING, Context, Decimal
from math import isnan, nan
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from coop_drake.drawing import colours
from coop_drake.drawing.canvas import house_style, picture_of
from coop_drake.drawing.colours import BLUE, GREY, INK, ORANGE, VERMILLION
from coop_drake.files import plain_numbers, write_atomically
from coop_drake.templates import rendered
from coop_drake.tree.arrays import FloatArray, IntArray

# The measured columns of a table of runs, how they are called and shown, and which rows belong together.


@dataclass(frozen=True)
class Measure:
    """A column of numbers that a run leaves.

    Attributes:
        name: Name of the column.
        label: Name in tables and figures.
        unit: Unit in which it is shown.
        factor: Shown number over that of the column [-].
        margin: Whether it is a distance to a limit: less is worse, and zero is lost.
    """

    name: str
    label: str
    unit: str
    factor: float
    margin: bool

    def shown(self, number: float) -> str:
        """A number of the column in the unit shown, with three significant digits; empty for NaN."""
        value = self.factor * number
        if np.isnan(value):
            return ""
        return significant(value)


def significant(value: float, digits: int = 3) -> str:
    """A number with some significant digits, and whole from 100 on."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.{digits}g}"


SHARE = "budget_share"
"""Name of the column that is lost beyond one, not below zero."""

MARGINS = (
    Measure("funnel_margin", "axis to the bound of its funnel", "mrad or mm", 1e3, True),
    Measure("cell_margin", "object to the boundary of its cell", "mm", 1e3, True),
    Measure("wall_clearance", "bodies to walls", "mm", 1e3, True),
    Measure("body_clearance", "bodies to bodies", "mm", 1e3, True),
)
"""Distances to what a run must not touch."""

COSTS = (
    Measure("time", "time to arrival", "s", 1.0, False),
    Measure("peak_force", "largest base force", "N", 1.0, False),
    Measure("peak_torque", "largest torque", "N m", 1.0, False),
    Measure(SHARE, "used of what the budget states", "%", 100.0, False),
)
"""What a run takes."""

MEASURES = (*MARGINS, *COSTS)


Columns = dict[str, NDArray[Any]]
"""The columns of a table of runs as arrays of shape (runs,), by their names."""


def count_trials(runs: Columns, chosen: NDArray[np.bool_] | None = None) -> int:
    """Return how many trials have a chosen row, by default any: a run that two tiers made is one trial."""
    rows = slice(None) if chosen is None else chosen
    return len(set(zip(runs["scenario"][rows], runs["run"][rows], strict=True)))


RunGroup = tuple[str, str, IntArray]
"""Scenario, tier and row numbers of runs that belong together."""


def groups_of(runs: Columns) -> list[RunGroup]:
    """Return scenario, tier and row numbers of the runs that belong together, sorted by name."""
    names = np.array([runs["scenario"], runs["tier"]], dtype=str)
    found, places = np.unique(names, axis=1, return_inverse=True)
    return [
        (str(scenario), str(tier), np.flatnonzero(places.ravel() == k))
        for k, (scenario, tier) in enumerate(found.T)
    ]


# How often runs are lost: the share counted, and the bound below which the true one lies.

CONFIDENCE = 0.95
"""Probability with which the true share of lost runs is not above its bound, at least [-]."""


@dataclass(frozen=True)
class Rate:
    """A share of lost runs with the upper bound of Clopper and Pearson.

    Attributes:
        lost: Runs that did not arrive, or broke an invariant.
        runs: Runs counted.
        upper: Upper bound of the true share; all of the error's probability is on this side, however many
            were lost, so that it is 1 - (1 - confidence)^(1 / runs) where none was [-].
        confidence: Probability with which the true share is not above the bound, at least [-].
    """

    lost: int
    runs: int
    upper: float
    confidence: float

    @property
    def sentence(self) -> str:
        """What was counted and what follows, in words."""
        counted = f"None of {self.runs:,} runs was lost."
        if self.lost:
            share, were = percent(self.lost / self.runs), "was" if self.lost == 1 else "were"
            counted = f"{self.lost:,} of {self.runs:,} runs {were} lost, {share}."
        sure = f"With {100.0 * self.confidence:g} % confidence"
        return f"{counted} {sure}, at most {percent_up(self.upper)} of them are."


def loss_rate(lost: int, runs: int, confidence: float = CONFIDENCE) -> Rate:
    """Return the share of lost runs with its exact upper bound (Clopper and Pearson).

    The bound has the same form whatever was counted: one that is chosen after the runs were counted would be
    wrong more often than it says.

    Args:
        lost: Runs that were lost.
        runs: Runs counted, at least one.
        confidence: Probability with which the true share is not above the bound, at least [-].

    Raises:
        ValueError: There are no runs, or more are lost than there are.
    """
    from scipy.stats import binomtest

    interval = binomtest(lost, runs, alternative="less").proportion_ci(confidence, method="exact")
    return Rate(lost, runs, float(interval.high), confidence)


def percent(share: float) -> str:
    """A share in per cent with two significant digits."""
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.3g} %"


def percent_up(share: float) -> str:
    """An upper bound in per cent, rounded up to two significant digits, and to three from 99 % on."""
    exact = Decimal(repr(float(share))) * 100
    return f"{float(Context(2 if share <= 0.99 else 3, ROUND_CEILING).plus(exact)):.3g} %"


# Distributions of margins, time and forces, and the share of lost runs, by scenario and tier.

_BINS = 30
"""Bins of a histogram [-]: a hill of a figure is some hundred points wide."""

_SAME = 4 * _BINS
"""Values whose range is at most this many units in the last place count as one value [-]."""

_REASONS = 5
"""Reasons for losses that are listed, the most frequent ones."""


@dataclass(frozen=True)
class Distribution:
    """How the values of a column are distributed, in its own unit; numbers are NaN where there are no values.

    Attributes:
        count: Values that are numbers.
        least: Smallest value.
        low: Below it are 5 % of them.
        median: Below it is one half.
        high: Below it are 95 %.
        largest: Largest value.
        heights: Counts of values in bins of equal width from the smallest to the largest value.
    """

    count: int
    least: float
    low: float
    median: float
    high: float
    largest: float
    heights: tuple[int, ...]


NOTHING = Distribution(0, nan, nan, nan, nan, nan, ())
"""The distribution of no values."""


@dataclass(frozen=True)
class Group:
    """The runs of one scenario in one tier.

    Attributes:
        scenario: Name of the scenario.
        tier: Which loop simulated it.
        rate: How many were lost.
        reasons: The most frequent reasons for losses, with their counts.
        measures: Distribution of every column that has numbers, by its name; margins over all runs, times and
            forces over those that arrived.
    """

    scenario: str
    tier: str
    rate: Rate
    reasons: tuple[tuple[str, int], ...]
    measures: dict[str, Distribution]


def distribution(values: FloatArray) -> Distribution | None:
    """Return the distribution of values, NaN left out; None if there are no others."""
    numbers = values[np.isfinite(values)]
    if numbers.size == 0:
        return None
    low, median, high = np.quantile(numbers, (0.05, 0.5, 0.95))
    ends = float(numbers.min()), float(numbers.max())
    return Distribution(
        int(numbers.size), ends[0], float(low), float(median), float(high), ends[1], _heights(numbers, ends)
    )  # fmt: skip


def _heights(numbers: FloatArray, ends: tuple[float, float]) -> tuple[int, ...]:
    """Return the counts in bins between the ends; all in the middle one where these would be rounding."""
    if ends[1] - ends[0] <= _SAME * np.spacing(max(map(abs, ends))):
        return tuple(numbers.size if place == _BINS // 2 else 0 for place in range(_BINS))
    return tuple(int(height) for height in np.histogram(numbers, bins=_BINS, range=ends)[0])


def summarise(runs: Columns, every: Sequence[RunGroup]) -> tuple[Group, ...]:
    """Return how the runs of every scenario and tier went."""
    groups = []
    for scenario, tier, rows in every:
        arrived = rows[runs["arrived"][rows]]
        known = {one.name: distribution(runs[one.name][rows if one.margin else arrived]) for one in MEASURES}
        reasons = Counter(runs["reason"][rows[~runs["arrived"][rows]]].tolist()).most_common(_REASONS)
        rate = loss_rate(rows.size - arrived.size, rows.size)
        measures = {name: values for name, values in known.items() if values is not None}
        groups.append(Group(scenario, tier, rate, tuple(reasons), measures))
    return tuple(groups)


# The runs that came nearest to a limit.

LISTED = 10
"""Runs that are listed [-]."""


@dataclass(frozen=True)
class WorstRun:
    """A run that was lost, or had little of a margin left.

    Attributes:
        run: Its number in the campaign.
        scenario: Name of the scenario.
        tier: Which loop simulated it.
        seed: Seed of its noise.
        arrived: Whether it arrived.
        reason: Why not; empty if it arrived.
        measure: Name of the margin of which it had least, compared with other runs of its scenario.
        margin: What it had of this, in the unit of the column.
        share: The same over the median of its scenario and tier [-].
        used: Share that it used of what the budget states; NaN without a budget [-].
        values: JSON of the keys that vary.
    """

    run: int
    scenario: str
    tier: str
    seed: int
    arrived: bool
    reason: str
    measure: str
    margin: float
    share: float
    used: float
    values: str


def worst_runs(runs: Columns, groups: Sequence[RunGroup]) -> tuple[WorstRun, ...]:
    """Return lost runs, then those that used more than the budget states, then those with the least margins.

    Margins count relative to the median of their scenario and tier.
    """
    margins = np.array([runs[measure.name] for measure in MARGINS])
    shares = np.full_like(margins, np.inf)
    for _, _, rows in groups:
        for k in range(len(MARGINS)):
            known = margins[k, rows][np.isfinite(margins[k, rows])]
            if known.size and (typical := float(np.median(known))) > 0.0:
                shares[k, rows] = margins[k, rows] / typical
    shares[np.isnan(shares)] = np.inf
    beyond = np.where(runs[SHARE] > 1.0, -runs[SHARE], 0.0)
    found = []
    for row in np.lexsort((runs["run"], shares.min(axis=0), beyond, runs["arrived"]))[:LISTED]:
        k = int(np.argmin(shares[:, row]))
        known_share = bool(np.isfinite(shares[k, row]))
        found.append(
            WorstRun(
                int(runs["run"][row]),
                runs["scenario"][row],
                runs["tier"][row],
                int(runs["seed"][row]),
                bool(runs["arrived"][row]),
                runs["reason"][row],
                MARGINS[k].name if known_share else "",
                float(margins[k, row]) if known_share else nan,
                float(shares[k, row]) if known_share else nan,
                float(runs[SHARE][row]),
                runs["values"][row],
            )
        )
    return tuple(found)


# All numbers of a report, gathered once for the page and for machines.


@dataclass(frozen=True)
class Report:
    """What a campaign found.

    Attributes:
        title: Name of the campaign.
        facts: What was asked for: name and value, in the order shown.
        rate: How many of all runs were lost; None without runs. Here and in the next number a run that both
            tiers made counts once: it has the same values and the same seed in both, and is lost if it was
            lost in any.
        exceeded: Runs that used more than all of what the budget states, lost or not.
        most_used: Largest share of what the budget states that a run used; NaN where none is known [-].
        groups: The runs of every scenario and tier.
        worst: The worst runs.
        missing: Batches of the campaign that are not made yet. Slow ones come last: what is there is not a
            random sample of what was asked for.
    """

    title: str
    facts: tuple[tuple[str, str], ...]
    rate: Rate | None
    exceeded: int
    most_used: float
    groups: tuple[Group, ...]
    worst: tuple[WorstRun, ...]
    missing: int

    def to_json(self) -> str:
        """Return all numbers as JSON; numbers that are not finite are null."""
        return json.dumps(plain_numbers(asdict(self)), indent=1, ensure_ascii=False) + "\n"


def make_report(
    title: str,
    runs: Any = None,
    *,
    facts: Sequence[tuple[str, str]] = (),
    missing: int = 0,
) -> Report:
    """Compute a report from the table of a campaign's runs.

    Args:
        title: Name of the campaign.
        runs: A pyarrow table with the columns of ``RunRecord``, None for no runs.
        facts: What was asked for: name and value.
        missing: Batches of the campaign that are not made yet.
    """
    if runs is None or runs.num_rows == 0:
        return Report(title, tuple(facts), None, 0, nan, (), (), missing)
    known = {name: runs[name].to_numpy() for name in runs.column_names}
    groups = groups_of(known)
    return Report(
        title,
        tuple(facts),
        loss_rate(count_trials(known, ~known["arrived"]), count_trials(known)),
        count_trials(known, known[SHARE] > 1.0),
        float(np.nanmax(known[SHARE])) if np.isfinite(known[SHARE]).any() else nan,
        summarise(known, groups),
        worst_runs(known, groups),
        missing,
    )


# The report as one self-contained HTML page, and the same numbers as JSON.

PAGE, NUMBERS = "report.html", "report.json"
"""Names of the two files."""

_BY_NAME = {measure.name: measure for measure in MEASURES}


def write_report(report: Report, directory: Path, replay: Callable[[WorstRun], str]) -> list[Path]:
    """Write the page and the numbers into a directory, and return the two files.

    Args:
        report: What the campaign found.
        directory: Where; it is made if it is not there.
        replay: Returns the command that replays a run.
    """
    directory.mkdir(parents=True, exist_ok=True)
    page = render_page(report, replay)
    return [
        write_atomically(directory / PAGE, page.encode()),
        write_atomically(directory / NUMBERS, report.to_json().encode()),
    ]


def render_page(report: Report, replay: Callable[[WorstRun], str]) -> str:
    """Return the page as HTML; it needs no other file and no script."""
    return rendered(
        "coop_drake.campaign",
        "report.html",
        report=report,
        headline=headline(report),
        verdict=verdict(report),
        rows=[_row(group) for group in report.groups],
        margins=MARGINS,
        worst=[(run, _shown(run.measure, run.margin), replay(run)) for run in report.worst],
        percent=percent,
        percent_up=percent_up,
        figures={
            "margins": distributions_svg(report.groups, MARGINS),
            "costs": distributions_svg(report.groups, COSTS),
        },
        colours=colours,
    )


def headline(report: Report) -> str:
    """The most important sentence of a report, and whether it is complete."""
    told = []
    if report.rate is not None:
        told.append(report.rate.sentence)
    if report.exceeded:
        runs = "1 run" if report.exceeded == 1 else f"{report.exceeded:,} runs"
        told.append(f"{runs} used more than the budget states, up to {percent(report.most_used)} of it.")
    if report.missing:
        several = "1 batch is" if report.missing == 1 else f"{report.missing:,} batches are"
        told.append(f"The campaign is not complete: {several} missing.")
    return " ".join(told) or "There are no results yet."


def verdict(report: Report) -> str:
    """``bad`` where a run was lost; ``some`` where more was used than is budgeted, or results are missing."""
    if report.rate is not None and report.rate.lost:
        return "bad"
    return "some" if report.exceeded or report.missing else "good"


def _shown(name: str, number: float) -> str:
    measure: Measure | None = _BY_NAME.get(name)
    return f"{measure.shown(number)} {measure.unit}" if measure is not None and not isnan(number) else ""


def _row(group: Group) -> dict[str, Any]:
    """What the first table shows of a group."""
    least = {
        one.name: one.shown(group.measures[one.name].least) for one in MARGINS if one.name in group.measures
    }
    time, force = group.measures.get("time"), group.measures.get("peak_force")
    return {
        "group": group,
        "least": least,
        "time": "" if time is None else f"{time.median:.1f} s, {time.largest:.1f} s",
        "force": "" if force is None else f"{force.largest:.0f} N",
    }


# The figures of a report as SVG that stands inside a page, with text in the page's colour.


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
