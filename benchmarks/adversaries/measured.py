"""Tasks of the adversaries: altered answers source by source and in all, and how long random answers take."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import process_time

import numpy as np

from benchmarks.adversaries.claims import judged_claims
from benchmarks.adversaries.questions import random_question
from benchmarks.adversaries.sources import SOURCES
from benchmarks.adversaries.trial import Judged, answered, judged_source, kind_of, refusal
from benchmarks.isolated import WorkerError, in_own_process
from benchmarks.rows import Row
from benchmarks.tasks import Rows, Task
from coop_drake.answers import PlannerSettings

SEEDS = {11: 172, 12: 172, 13: 171}
"""Seeds of random questions, with how many are answered and checked for each."""

SLICES = 500
"""Budget of slices of a random question, so that one which stays undecided takes seconds [-]."""

TEAMS = ("warehouse", "base")
"""Scenarios whose plans' claims are altered."""

CLAIMED = 4
"""How many times each kind of claim is altered."""

LIMIT = 1200.0
"""CPU time that a source or a seed may take [s]."""


@dataclass(frozen=True)
class Timed:
    """A random question's answer.

    Attributes:
        kind: The kind of answer, ``undecided`` if there is none.
        planning: CPU time until there was one [s].
        checking: CPU time of the exact checker [s].
        refusal: Why the checker refuses it, empty if it accepts.
    """

    kind: str
    planning: float
    checking: float
    refusal: str


def adversary_tasks() -> list[Task]:
    """Random answers, altered plans and proofs of every kind, and the sums over all their sources."""
    tally: list[Judged] = []
    return [
        *(_random_task(seed, count) for seed, count in SEEDS.items()),
        *(
            _source_task(name, partial(judged_source, ask, rounds), tally)
            for name, (ask, rounds) in SOURCES.items()
        ),
        *(_source_task(f"claims/{team}", partial(judged_claims, team, CLAIMED), tally) for team in TEAMS),
        Task("adversaries/totals", lambda rows: _totals(tally), alone=True),
    ]


def random_answers(seed: int, count: int) -> list[Timed]:
    """Answer random questions and check the answers, which are not altered."""
    found = []
    for problem in filter(None, (random_question([seed, k]) for k in range(count))):
        times = [process_time()]
        documents = answered(replace(problem, settings=PlannerSettings(max_slices=SLICES)))
        times.append(process_time())
        refused = "" if documents is None else refusal(*documents)
        planning, checking = np.diff([*times, process_time()]).tolist()
        found.append(
            Timed(
                "undecided" if documents is None else kind_of(documents[1]),
                planning,
                checking,
                refused,
            )
        )
    return found


def _random_task(seed: int, count: int) -> Task:
    def measure(rows: Rows) -> Rows:
        found = in_own_process(random_answers, seed, count, limit=LIMIT).value
        if found is None:
            raise WorkerError(f"random questions of seed {seed} took more than {LIMIT:.0f} s")
        return list(_random_rows(seed, found))

    return Task(f"adversaries/random/{seed}", measure)


def _random_rows(seed: int, found: Sequence[Timed]) -> Iterator[Row]:
    for kind in ("all", *sorted({one.kind for one in found})):
        ones, name = [one for one in found if kind in ("all", one.kind)], f"adversaries/random/{seed} {kind}"
        yield Row(f"{name}/answers", len(ones), "answers")
        yield Row(f"{name}/refused", sum(bool(one.refusal) for one in ones), "answers")
        for what in ("checking", "planning"):
            spent = [getattr(one, what) for one in ones]
            for figure, share in (("median", 0.5), ("of 95 in 100", 0.95), ("longest", 1.0)):
                yield Row(f"{name}/{what}, {figure}", float(np.quantile(spent, share)), "s")
    for k, one in enumerate(found):
        if one.refusal:
            yield Row(f"adversaries/refused random answers/{seed}, {k}/answer", 0.0, one.refusal)


def _source_task(name: str, judge: Callable[[], list[Judged]], tally: list[Judged]) -> Task:
    def measure(rows: Rows) -> Rows:
        found = in_own_process(judge, limit=LIMIT).value
        if found is None:
            raise WorkerError(f"alterations of {name} took more than {LIMIT:.0f} s")
        tally.extend(found)
        source = name.split("/")[-1]
        return [
            row
            for answer in dict.fromkeys(one.answer for one in found)
            for row in _counts(f"adversaries/{answer}/{source}", [o for o in found if o.answer == answer])
        ] + [
            Row(f"adversaries/wrong/{source}, {one.kind} ({k})/answer", 0.0, f"{one.truth}; {one.refusal}")
            for k, one in enumerate(found)
            if one.wrong
        ]

    return Task(f"adversaries/{name}", measure)


def _totals(tally: Sequence[Judged]) -> Rows:
    """For each kind of answer, and for each kind of alteration of it, the sums over all sources."""
    rows = list[Row]()
    for answer in dict.fromkeys(one.answer for one in tally):
        found = [one for one in tally if one.answer == answer]
        rows += _counts(f"adversaries/all sources/{answer}", found)
        for kind in dict.fromkeys(one.kind for one in found):
            rows += _counts(
                f"adversaries/altered {answer}/{kind}", [one for one in found if one.kind == kind]
            )
    return rows


def _counts(name: str, found: Iterable[Judged]) -> list[Row]:
    """How many altered answers are false, true or open, and what the checker says of them."""
    counts = Counter((one.truth.split(":")[0], "refused" if one.refusal else "accepted") for one in found)
    figures = {
        "altered": counts.total(),
        "false": counts["false", "accepted"] + counts["false", "refused"],
        "false, accepted": counts["false", "accepted"],
        "true, accepted": counts["true", "accepted"],
        "true, refused": counts["true", "refused"],
        "open, accepted": counts["open", "accepted"],
        "open, refused": counts["open", "refused"],
    }
    return [Row(f"{name}/{figure}", value, "answers") for figure, value in figures.items()]
