"""The searches and bisections of a campaign, each with a file for its result, so that none is made twice."""

from __future__ import annotations

import json
import multiprocessing
import os
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, replace
from math import inf
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

import numpy as np

from coop_drake.answers.digest import content_digest
from coop_drake.campaign.plans import versions
from coop_drake.campaign.results import CampaignFolder
from coop_drake.campaign.search.bounds import BoundedDepartures
from coop_drake.campaign.search.breaking import first_lost
from coop_drake.campaign.search.findings import BreakingPoint, Finding
from coop_drake.campaign.search.multiples import SCALED, departures_at, largest_multiple
from coop_drake.campaign.search.settings import Breaking, Searches
from coop_drake.campaign.search.trials import Trials
from coop_drake.campaign.search.worst import in_column, search_worst
from coop_drake.campaign.settings import Campaign
from coop_drake.errors import ProcessError
from coop_drake.files import write_atomically
from coop_drake.interrupts import uninterrupted
from coop_drake.progress import Progress

_FOLDER = "searches"
"""Where results of searches and bisections are, below the campaign's folder."""


_TRIALS: dict[tuple[str, str, str, str], Trials] = {}
"""What makes runs in this process: jobs of one scenario share its plan and maps."""


@dataclass(frozen=True)
class Job:
    """One search, or the bisection of one departure.

    Attributes:
        campaign: The campaign.
        folder: The folder of its results.
        scenario: Name of the scenario, as the campaign file has it.
        seed: Seed of the search, or of the runs.
        departure: What is multiplied; empty for a search.
    """

    campaign: Campaign
    folder: Path
    scenario: str
    seed: int
    departure: str = ""

    @property
    def asked(self) -> Searches | Breaking:
        """The section that asks for the job."""
        found = self.campaign.breaking if self.departure else self.campaign.searches
        assert found is not None  # or there would be no job
        return found

    def trials(self) -> Trials:
        """Return what makes the job's runs; the same for jobs that ask for the same ones."""
        key = str(self.campaign.path), str(self.folder), self.scenario, repr(self.asked)
        if key not in _TRIALS:
            _TRIALS[key] = Trials(self.campaign, self.asked, self.scenario, CampaignFolder(self.folder))
        return _TRIALS[key]

    def file(self) -> Path:
        """Return the file of the result, named by the digest of all that it depends on."""
        asked: dict[str, Any] = asdict(self.asked)
        if isinstance(self.asked, Searches):
            del asked["count"]  # A further search does not change those before.
        else:
            del asked["departures"]
        parts = {name: value for name, value in asked.items() if name != "scenarios"}
        job = {"scenario": self.scenario, "seed": self.seed, "departure": self.departure}
        content = {**parts, **job, "plan": self.trials().digest, "versions": versions()}
        return self.folder / _FOLDER / f"{content_digest(content)}.json"


def jobs_of(campaign: Campaign, folder: Path) -> list[Job]:
    """Return all searches and bisections that a campaign asks for."""
    jobs = []
    if (searches := campaign.searches) is not None:
        for name in searches.scenarios:
            jobs += [Job(campaign, folder, name, searches.seed + k) for k in range(searches.count)]
    if (breaking := campaign.breaking) is not None:
        for name in breaking.scenarios:
            jobs += [Job(campaign, folder, name, breaking.seed, one) for one in breaking.departures]
    return jobs


def run_jobs(campaign: Campaign, folder: Path, workers: int, progress: Progress | None = None) -> int:
    """Make the searches and bisections whose results are not there, by processes.

    Args:
        campaign: The campaign.
        folder: The folder of its results.
        workers: How many are made at a time.
        progress: Called with what is done and the fraction of it.

    Returns:
        How many were made.

    Raises:
        ProcessError: A process was lost.
    """
    jobs = jobs_of(campaign, folder)
    missing = [job for job in jobs if not job.file().exists()]
    for name in dict.fromkeys((job.scenario, bool(job.departure)) for job in missing):
        first = next(job for job in missing if (job.scenario, bool(job.departure)) == name)
        _ = first.trials().budget  # Processes find the plan in the folder.
    if not missing:
        return 0
    context, drake = multiprocessing.get_context("spawn"), any(job.asked.tier == "drake" for job in missing)
    with uninterrupted():
        # Drake keeps some memory of every plant, which ends with the process.
        pool = ProcessPoolExecutor(
            workers, context, _end_with_command, max_tasks_per_child=1 if drake else None
        )
        futures = [pool.submit(carry_out, job) for job in missing]
    try:
        for count, future in enumerate(as_completed(futures), start=1 + len(jobs) - len(missing)):
            future.result()
            if progress is not None:
                progress(f"{count} of {len(jobs)} searches", count / len(jobs))
    except BrokenProcessPool as error:
        message = "a process that searched was lost; the same command goes on from here"
        raise ProcessError(message) from error
    finally:  # After Ctrl-C `shutdown` alone would wait for searches that are being made.
        for process in list((pool._processes or {}).values()):
            process.terminate()
        pool.shutdown(cancel_futures=True)
    return len(missing)


def _end_with_command() -> None:
    """Let this process end when the one that started it has ended, however that was."""
    parent = multiprocessing.parent_process()
    assert parent is not None  # only processes of a pool call this

    def watch(sentinel: int) -> None:
        wait([sentinel])
        os._exit(1)

    threading.Thread(target=watch, args=(parent.sentinel,), daemon=True).start()


def carry_out(job: Job) -> None:
    """Make a search or a bisection, and write its result."""
    result = _broken(job) if job.departure else _searched(job)
    content = asdict(result)
    if isinstance(result, BreakingPoint):
        content["lost"] = result.beyond
    write_atomically(job.file(), json.dumps(content, indent=1).encode() + b"\n")


def findings_of(campaign: Campaign, folder: Path) -> tuple[list[Finding], list[BreakingPoint]]:
    """Return the results of those searches and bisections that are there, in the order of the file."""
    findings: list[Finding] = []
    points: list[BreakingPoint] = []
    for job, content in _results(campaign, folder):
        if job.departure:
            points.append(BreakingPoint(**{**content, "lost": content["lost"] or inf}))
        else:
            findings.append(Finding(**content))
    return findings, points


def _results(campaign: Campaign, folder: Path) -> Iterator[tuple[Job, dict[str, Any]]]:
    for job in jobs_of(campaign, folder):
        if (file := job.file()).exists():
            yield job, json.loads(file.read_bytes())


def _searched(job: Job) -> Finding:
    asked, trials = job.asked, job.trials()
    assert isinstance(asked, Searches)
    bounded = BoundedDepartures(trials.budget, trials.tree)
    found = search_worst(
        np.random.default_rng(job.seed).uniform(size=len(bounded.names)),
        lambda fractions: bounded.values(fractions, asked.factor),
        trials.run_all,
        margin=asked.margin,
        evaluations=asked.evaluations,
        seed=job.seed,
    )
    file = job.folder / "found" / f"{trials.name}_{job.seed}.campaign.yaml"
    trials.write_found(found.values, file)
    return Finding(
        trials.name,
        asked.tier,
        job.seed,
        len(found.margins),
        asked.margin,
        in_column(found.margins[0], asked.margin),
        in_column(min(found.margins), asked.margin),
        found.record.arrived,
        found.record.reason,
        str(file.relative_to(job.folder)),
    )


def _broken(job: Job) -> BreakingPoint:
    asked, trials = job.asked, job.trials()
    assert isinstance(asked, Breaking)
    budget, tree = trials.budget, trials.tree

    def lost(multiple: float) -> str:
        for seed in range(job.seed, job.seed + asked.runs):
            (record,) = trials.run_all([departures_at(budget, tree, job.departure, multiple, seed)], seed)
            if not record.arrived:
                return record.reason
        return ""

    largest = largest_multiple(budget, job.departure, asked.largest)
    kept, upper, reason = first_lost(lost, asked.halvings, largest)
    certified = getattr(budget, SCALED[job.departure][0])
    point = BreakingPoint(trials.name, asked.tier, job.departure, certified, kept, upper, asked.runs, reason)
    return replace(point, certified=1.0) if job.departure == "all" else point
