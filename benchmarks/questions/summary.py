"""How the planner answered random questions: verdicts, wrong answers and times, and how times grow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import inf, isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.questions.answering import QuestionRecord
from coop_drake.campaign.report import NOTHING, Distribution, distribution, significant

ALL = "all"
"""Name of the group of all questions."""

CORNERS = (0, 13, 25, 49, 97)
"""Least numbers of corners of the groups of floors [-]: about twice as many in each as in the one before."""

JOINTS = (1, 3, 5, 8)
"""Least numbers of joints of the groups of teams [-]."""

WIDTHS = (0.0, 0.8, 1.0, 1.2, 1.5)
"""Least widths of passages of the groups, over that of the narrowest corridor in which the team fits [-]."""


@dataclass(frozen=True)
class Questions:
    """The questions of one group, or all of them.

    Attributes:
        axis: By what they are grouped: ``floor``, ``robots``, ``joints``, ``corners`` or ``width``; ``all``.
        group: The value, or the values, of all questions in the group.
        count: Questions asked, those that failed with them.
        plans: Answered with a plan.
        beyond_limits: Answered with a plan that limits of the scenario refuse.
        infeasible: Answered with a proof that there is none.
        undecided: Answered with neither.
        refused: Answers that the exact checker refused, and errors of the planner.
        contact: Plans with a sampled configuration at which something touches.
        contradicted: Proofs of infeasibility although another planner found a way.
        wrong: Answers that are wrong for any of these three reasons.
        peer_found: Undecided questions for which another planner found a way.
        seconds: CPU time of the answers; questions that failed have none [s].
    """

    axis: str
    group: str
    count: int
    plans: int
    beyond_limits: int
    infeasible: int
    undecided: int
    refused: int
    contact: int
    contradicted: int
    wrong: int
    peer_found: int
    seconds: Distribution

    def cells(self) -> tuple[str, ...]:
        """Return a row of a table."""
        counts = (self.count, self.plans, self.beyond_limits, self.infeasible, self.undecided, self.wrong)
        times = (self.seconds.median, self.seconds.high, self.seconds.largest)
        name = ALL if self.axis == ALL else f"{self.axis} {self.group}"
        return name, *map(str, counts), *map(seconds_shown, times)


def seconds_shown(time: float) -> str:
    """A time with two significant digits; empty for NaN."""
    return "" if isnan(time) else f"{significant(time, 2)} s"


def summarise_questions(table: Any) -> tuple[Questions, ...]:
    """Return how the questions of every group were answered, and all of them in the last row.

    Of a question whose process was lost nothing is known but that it was asked: it counts in the last
    row alone.

    Args:
        table: A pyarrow table with the columns of ``QuestionRecord``.
    """
    columns = {name: np.asarray(table[name].to_pylist()) for name in table.schema.names}
    columns["wrong"] = np.array([QuestionRecord(**row).is_wrong for row in table.to_pylist()])
    return tuple(
        _count(axis, group, {name: column[own] for name, column in columns.items()})
        for axis, group, own in _groups(columns)
        if own.any()
    )


def _groups(columns: dict[str, NDArray[Any]]) -> Iterator[tuple[str, str, NDArray[np.bool_]]]:
    """Yield what is grouped by, the group's name, and which questions belong to it."""
    known = columns["floor"] != ""
    for axis in ("floor", "robots"):
        for value in np.unique(columns[axis][known]):
            yield axis, str(value), known & (columns[axis] == value)
    for axis, least in (("joints", JOINTS), ("corners", CORNERS)):
        for low, high in pairwise((*least, inf)):
            name = f"{low} or more" if high == inf else f"{low} to {high - 1:g}"
            yield axis, name, known & (columns[axis] >= low) & (columns[axis] < high)
    for low, high in pairwise((*WIDTHS, inf)):
        name = f"{low:g} or more" if high == inf else f"{low:g} to {high:g}"
        yield "width", name, (columns["width_ratio"] >= low) & (columns["width_ratio"] < high)
    yield ALL, ALL, np.ones(len(columns["floor"]), dtype=bool)


def _count(axis: str, group: str, columns: dict[str, NDArray[Any]]) -> Questions:
    plans, beyond, infeasible, undecided = (
        columns["verdict"] == verdict for verdict in ("plan", "beyond limits", "infeasible", "undecided")
    )
    found = columns["peer_found"].astype(bool)
    refused = ~columns["verified"].astype(bool) & ~undecided
    contact = (plans | beyond) & (columns["sampled_margin"].astype(float) <= 0.0)
    answered = columns["verdict"] != "failed"
    seconds = distribution(columns["cpu_seconds"].astype(float)[answered]) or NOTHING
    return Questions(
        axis,
        group,
        len(plans),
        plans=int(plans.sum()),
        beyond_limits=int(beyond.sum()),
        infeasible=int(infeasible.sum()),
        undecided=int(undecided.sum()),
        refused=int(refused.sum()),
        contact=int(contact.sum()),
        contradicted=int((infeasible & found).sum()),
        wrong=int(columns["wrong"].sum()),
        peer_found=int((undecided & found).sum()),
        seconds=seconds,
    )
