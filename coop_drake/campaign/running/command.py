"""Runs a campaign from its file to its results, or the rest of one that was interrupted."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from coop_drake.campaign.batches import Batch, Batching
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.results import CampaignFolder
from coop_drake.campaign.running.making import RunMaker
from coop_drake.campaign.running.placing import check_scheduler, place
from coop_drake.campaign.running.supervising import Order
from coop_drake.campaign.settings import Campaign, Tier
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
    variation = Variation(campaign)
    variation.check()
    return tuple(Batching(variation, Plans(variation, folder.plans)).batches())


def run_campaign(
    campaign: Campaign,
    out: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Make all runs of a campaign whose results are not there yet.

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
    folder = CampaignFolder(out.absolute())

    def prepare(missing: Sequence[Batch]) -> None:
        """Make the plans, which processes find in the folder, and check the runs."""
        variation = Variation(campaign)
        plans = Plans(variation, folder.plans)
        for tier, scenario in dict.fromkeys((batch.tier, batch.scenario) for batch in missing):
            plans.with_maps(variation.run(scenario * variation.runs_of_scenario), progress)
            RunMaker(variation, plans, cast(Tier, tier), folder.path / "logs").check(scenario)

    return make_batches(
        campaign.path,
        folder,
        batches_of(campaign, folder),
        prepare,
        lambda batch: campaign.runs.time_limit,
        workers=workers,
        scheduler=scheduler,
        progress=progress,
    )


def make_batches(
    file: Path,
    folder: CampaignFolder,
    batches: tuple[Batch, ...],
    prepare: Callable[[Sequence[Batch]], None],
    time_limit: Callable[[Batch], float],
    *,
    workers: int | None,
    scheduler: str | None,
    progress: Progress | None,
) -> Outcome:
    """Make the batches whose results are not there yet, in processes of their own.

    Args:
        file: What says what they are; processes read the copy of it in the folder.
        folder: Where results go.
        batches: All of them.
        prepare: Called with those that are not there, before any is made; what it raises ends the call.
        time_limit: Longest that a process may take for a piece of a batch, or between signs of life [s].
        workers: As in ``run_campaign``, and so are the others and the errors.
        scheduler: As there.
        progress: As there.
    """
    advance = progress or (lambda doing, fraction: None)
    if scheduler is not None:
        check_scheduler(scheduler)
    with _locked(folder):
        write_atomically(folder.campaign, file.read_bytes())
        missing = folder.missing(batches)
        prepare(missing)
        there = len(batches) - len(missing)
        done: set[str] = set()

        def note(batch: Batch) -> None:
            done.add(batch.digest)
            count = there + len(done)
            advance(f"{count} of {len(batches)} batches", count / len(batches))

        name = str(file.absolute())
        orders = [Order(name, str(folder.path), one, time_limit(one)) for one in missing]
        if orders:
            place(orders, workers, scheduler, note)
        return Outcome(folder, batches, len(done))


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
