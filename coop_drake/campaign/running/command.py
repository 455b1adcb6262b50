"""Runs a campaign from its file to its results, or the rest of one that was interrupted."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from coop_drake.campaign.batches import PLANNER, Batch, Batching, question_batches
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.questions.settings import QuestionSettings
from coop_drake.campaign.records import RunRecord
from coop_drake.campaign.results import CampaignFolder
from coop_drake.campaign.running.making import RunMaker
from coop_drake.campaign.running.placing import check_scheduler, place
from coop_drake.campaign.running.supervising import Order
from coop_drake.campaign.search.searching import Searching, search_batches, section_of
from coop_drake.campaign.settings import Campaign
from coop_drake.campaign.variation import Variation
from coop_drake.errors import ScenarioError
from coop_drake.files import write_atomically
from coop_drake.progress import Progress


@dataclass(frozen=True)
class Outcome:
    """What a campaign has come to.

    Attributes:
        folder: Where its results are.
        batches: All of its batches.
        made: How many of them this call has made; the others were there.
    """

    folder: CampaignFolder
    batches: tuple[Batch, ...]
    made: int


def batches_of(campaign: Campaign, folder: CampaignFolder) -> tuple[Batch, ...]:
    """Return the batches of a campaign, after a check of all that varies.

    Raises:
        ScenarioError: The campaign file or a scenario is wrong.
    """
    asked = () if campaign.questions is None else tuple(question_batches(campaign.questions))
    others = *asked, *search_batches(campaign, folder)
    if campaign.runs is None:
        return others
    variation = Variation(campaign)
    variation.check()
    return *Batching(variation, Plans(variation, folder.plans)).batches(), *others


def run_campaign(
    campaign: Campaign,
    out: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Make all runs and searches and answer all questions of a campaign whose results are not there yet.

    Args:
        campaign: The campaign.
        out: The folder of its results; every worker must see it under this name.
        workers: How many batches are made at a time on this machine; one a core by default.
        scheduler: Address of a Dask scheduler that exists, in place of workers on this machine.
        progress: Called with what is done and the fraction of it.

    Raises:
        ScenarioError: The file or a scenario is wrong, or another command works in the folder.
        PlanError: There is no plan for a scenario.
        ProcessError: Workers were lost for good; the same call goes on from there.
        OSError: Results cannot be written.
    """
    advance = progress or (lambda doing, fraction: None)
    if scheduler is not None:
        check_scheduler(scheduler)
    folder = CampaignFolder(out.absolute())
    batches = batches_of(campaign, folder)
    with _locked(folder):
        write_atomically(folder.campaign, campaign.path.read_bytes())
        missing = folder.missing(batches)
        _plan(campaign, folder, missing, progress)
        there = len(batches) - len(missing)
        done: set[str] = set()

        def note(batch: Batch) -> None:
            done.add(batch.digest)
            count = there + len(done)
            advance(f"{count} of {len(batches)} batches", count / len(batches))

        file = str(campaign.path.absolute())
        orders = [Order(file, str(folder.path), one, _time_limit(campaign, one)) for one in missing]
        if orders:
            place(orders, workers, scheduler, note)
        return Outcome(folder, batches, len(done))


def _plan(
    campaign: Campaign, folder: CampaignFolder, missing: Iterable[Batch], progress: Progress | None
) -> None:
    """Make the plans of batches that are not there, which processes find in the folder, and check the runs.

    Raises:
        ScenarioError: A loop does not know what it shall simulate.
        PlanError: There is no plan for a scenario.
    """
    asked = {(batch.tier, batch.scenario): batch.record for batch in missing if batch.tier != PLANNER}
    variation = Variation(campaign) if RunRecord in asked.values() else None
    for kind, scenario in asked:
        if kind == "search" or kind == "breaking":
            Searching(campaign, folder, kind, scenario).trials.check()
        elif variation is not None:
            plans = Plans(variation, folder.plans)
            plans.with_maps(variation.run(scenario * variation.runs_of_scenario), progress)
            RunMaker(variation, plans, kind, folder.path / "logs").check(scenario)


def _time_limit(campaign: Campaign, batch: Batch) -> float:
    """Longest that a process may take for a run or a question of a batch, or for a run of a search [s]."""
    if batch.tier == PLANNER:
        limits: Any = campaign.questions
    elif batch.tier == "search" or batch.tier == "breaking":
        limits = section_of(campaign, batch.tier)
    else:
        limits = campaign.runs
    assert limits is not None  # or there would be no such batch
    longest: float = limits.longest if isinstance(limits, QuestionSettings) else limits.time_limit
    return longest


@contextmanager
def _locked(folder: CampaignFolder) -> Iterator[None]:
    """Hold the lock of a folder, which ends with this process however it ends.

    Raises:
        ScenarioError: Another process holds it.
    """
    folder.path.mkdir(parents=True, exist_ok=True)
    with folder.lock.open("a+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.seek(0)
            allowed = f"a folder in which no other command works; process {file.read().strip()} does"
            raise ScenarioError(str(folder.path), "--out", str(folder.path), allowed) from None
        file.truncate(0)
        file.write(f"{os.getpid()}\n")
        file.flush()
        yield
