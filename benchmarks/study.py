"""``python -m benchmarks study FILE``: random questions and searches for departures, made as campaigns are.

A file has any of the sections ``questions``, ``searches`` and ``breaking``; processes, folders and Dask are
those of `coop_drake.campaign`.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from math import isnan
from pathlib import Path
from typing import Annotated, Any

from benchmarks.questions.answering import QuestionRecord, question_batches
from benchmarks.questions.settings import QuestionSettings
from benchmarks.questions.summary import Questions, summarise_questions
from benchmarks.searches.findings import (
    BreakingPoint,
    Finding,
    ends_shown,
    is_good,
    multiple_shown,
    sentence,
    sentences,
    summarise_searches,
)
from benchmarks.searches.searching import (
    Breaking,
    Searches,
    Searching,
    SearchKind,
    search_batches,
    section_of,
)
from coop_drake.campaign.execution import Outcome, make_batches
from coop_drake.campaign.records import Batch, CampaignFolder
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.errors import ScenarioError
from coop_drake.files import write_atomically
from coop_drake.progress import Progress
from coop_drake.scenario.document import read_file
from coop_drake.typed_data import HIDDEN

NAMES = {"planner": "question", "search": "search", "breaking": "bisection"}
"""What the batches of a study consist of, by their tiers."""


@dataclass(frozen=True)
class Study:
    """What a study does; it has at least one section.

    Attributes:
        questions: Random planning questions; null for none.
        searches: Searches for runs with small margins; null for none.
        breaking: Multiples of a budget at which runs are first lost; null for none.
        path: The file it was read from.
    """

    questions: QuestionSettings | None = None
    searches: Searches | None = None
    breaking: Breaking | None = None
    path: Annotated[Path, HIDDEN] = Path("study.yaml")

    @property
    def name(self) -> str:
        """The file's name without its endings."""
        return self.path.name.partition(".")[0]


def load_study(path: Path, original: Path | None = None) -> Study:
    """Read the file of a study.

    Args:
        path: The file.
        original: Where the file that this is a copy of is: names of scenarios are relative to it.

    Raises:
        ScenarioError: With file, key, value and what is allowed there.
    """
    study = dataclasses.replace(read_file(Study, path), path=original or path)
    if study == Study(path=study.path):
        raise ScenarioError(str(path), "the file", "no section", "questions, searches or breaking")
    return study


def batches_of(study: Study, folder: CampaignFolder) -> tuple[Batch, ...]:
    """Return the batches of a study.

    Raises:
        ScenarioError: A scenario or what is set in it is wrong.
    """
    asked = () if study.questions is None else question_batches(study.questions)
    return *asked, *search_batches(study, folder)


def make_study(
    study: Study,
    folder: CampaignFolder,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Answer questions and make searches whose results are not there, as ``run_campaign`` makes runs."""

    def prepare(missing: Sequence[Batch]) -> None:
        for kind, scenario in dict.fromkeys((batch.tier, batch.scenario) for batch in missing):
            if kind != "planner":
                Searching(study, folder, _kind(kind), scenario).trials.check()

    def time_limit(batch: Batch) -> float:
        if batch.tier == "planner":
            assert study.questions is not None  # or there would be no such batch
            return study.questions.longest
        asked = section_of(study, _kind(batch.tier))
        assert asked is not None
        return asked.time_limit

    batches = batches_of(study, folder)
    return make_batches(
        study.path,
        folder,
        batches,
        prepare,
        time_limit,
        workers=workers,
        scheduler=scheduler,
        progress=progress,
    )


def _kind(tier: str) -> SearchKind:
    return "search" if tier == "search" else "breaking"


@dataclass(frozen=True)
class Results:
    """What a study has come to so far.

    Attributes:
        questions: How questions were answered, group by group, all of them in the last one.
        findings: What searches found.
        points: What bisections found.
        missing: Batches that are not made yet.
    """

    questions: tuple[Questions, ...] = ()
    findings: tuple[Finding, ...] = ()
    points: tuple[BreakingPoint, ...] = ()
    missing: int = 0

    @property
    def headline(self) -> str:
        """What was found, in sentences."""
        told = []
        if self.questions:
            every = self.questions[-1]
            wrong = "1 wrong answer" if every.wrong == 1 else f"{every.wrong:,} wrong answers"
            told.append(f"{every.count:,} questions: {wrong}, {every.undecided:,} undecided.")
        told += [sentence(self.findings)] if self.findings else []
        told += sentences(self.points)
        if self.missing:
            several = "1 batch is" if self.missing == 1 else f"{self.missing:,} batches are"
            told.append(f"The study is not complete: {several} missing.")
        return " ".join(told) or "There are no results yet."

    @property
    def good(self) -> bool:
        """Whether nothing was wrong, lost or not known."""
        wrong = any(row.wrong for row in self.questions)
        return not wrong and all(one.arrived for one in self.findings) and all(map(is_good, self.points))


def results_of(folder: CampaignFolder, batches: Sequence[Batch]) -> Results:
    """Read what a study has come to so far."""
    table = folder.records(batches, QuestionRecord).sort_by("question")
    findings = folder.records(batches, Finding).to_pylist()
    points = folder.records(batches, BreakingPoint).to_pylist()
    return Results(
        summarise_questions(table) if table.num_rows else (),
        tuple(Finding(**row) for row in findings),
        tuple(BreakingPoint(**row) for row in points),
        len(folder.missing(batches)),
    )


def show_results(folder: CampaignFolder, batches: Sequence[Batch], reporter: Reporter) -> None:
    """Show what a study has come to, and write it as study.json; what is not good makes the command fail."""
    results = results_of(folder, batches)
    facts: dict[str, Any] = {
        "headline": results.headline,
        "questions": [asdict(row) for row in results.questions],
        "searches": [asdict(one) for one in results.findings],
        "breaking": [{**asdict(one), "lost": one.beyond} for one in results.points],
        "missing": results.missing,
    }
    for tier, name in NAMES.items():
        mine = [batch for batch in batches if batch.tier == tier]
        if not isnan(seconds := folder.cpu_seconds(mine)):
            facts[f"cpu_seconds_of_a_{name}"] = seconds
    if others := folder.by_other_sources(batches):
        facts["batches_by_other_sources"] = others
        reporter.say(
            f"{others} of the batches were made by other sources of coop_drake than those of this command"
        )
    write_atomically(folder.path / "study.json", json.dumps(facts, indent=1).encode() + b"\n")
    reporter.facts.update(facts)
    for title, rows, headings, first in tables(results):
        reporter.table(title, rows, headings, first, padding=0)
    reporter.say(results.headline)
    reporter.say(f"All results are in {folder.path}")
    if not results.good:
        reporter.code = ExitCode.FAILED_RUN


_ANSWERS = "asked", "plans", "beyond\nlimits", "no\nway", "un-\ndecided", "wrong"


def tables(results: Results) -> Iterator[tuple[str, list[tuple[str, ...]], tuple[str, ...], str]]:
    """Yield title, rows, headings and the rows' own heading of what there is, in 80 columns."""
    if results.questions:
        yield (
            "questions",
            [row.cells() for row in results.questions],
            (*_ANSWERS, "CPU\ntime", "95 %", "largest"),
            "questions by",
        )
    if results.findings:
        rows: list[tuple[str, ...]] = [
            (
                f"{row.scenario}, {row.margin.replace('_', ' ')}",
                *map(str, (row.searches, row.runs, row.lost, row.failed)),
                *(f"{number:.4f}" for number in (row.before, row.typical, row.worst.worst)),
            )
            for row in summarise_searches(results.findings)
        ]
        heads = "searches", "runs", "found\na loss", "not\nmade", "random", "usual\nfind", "worst\nfind"
        yield "searches", rows, heads, "scenario, driven"
    if results.points:
        rows = [
            (f"{one.scenario}, {one.departure}", *ends_shown(one), multiple_shown(one), one.reason or "none")
            for one in results.points
        ]
        ends = "certified", "no loss\nup to", "loss at", "multiple\nwithout one", "the loss"
        yield "breaking points", rows, ends, "departure"
