"""A process that makes the runs, questions or searches of one batch, writes a line for each, and ends.

``python -m coop_drake.campaign.running.child ORDER`` with the order as JSON. Drake keeps some memory of every
plant, which ends with the process. Lines on standard output are JSON: ``["begun", record]`` and ``["ended",
record]`` for each of them, ``["alive", null]`` after each run of a search, ``["costs", mapping]`` at the end,
``["error", message]`` where none can be made.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any

from coop_drake.errors import CoopDrakeError

if TYPE_CHECKING:
    from coop_drake.campaign.batches import Batch
    from coop_drake.campaign.records import Record
    from coop_drake.campaign.results import CampaignFolder
    from coop_drake.campaign.settings import Campaign

    Task = tuple[Record, Callable[[], Record]]  # The record while it is made, and what makes it.


def main(order: dict[str, Any]) -> int:
    """Make the runs of an order; return the exit code.

    Args:
        order: The fields of `Order`, ``begin`` for the index of the first one to be made, and ``scratch`` for
            a folder of this process alone, which is removed after it.
    """
    tempfile.tempdir = order["scratch"]
    threading.Thread(target=_end_with_supervisor, args=(order["scratch"],), daemon=True).start()
    try:
        _make(order)
    except (CoopDrakeError, OSError) as error:  # A full disk is no fault of the run that met it.
        _say("error", str(error))
        return 1
    return 0


def _make(order: dict[str, Any]) -> None:
    from coop_drake.campaign.plans import source_digest
    from coop_drake.campaign.results import CampaignFolder
    from coop_drake.campaign.settings import load_campaign
    from coop_drake.memory import peak_memory_mb

    sources = source_digest()  # Before runs are made, because somebody may edit the sources meanwhile.
    folder = CampaignFolder(Path(order["folder"]))
    campaign = load_campaign(folder.campaign, Path(order["campaign"]))
    kinds = {"planner": _questions, "search": _searches, "breaking": _searches}
    made = kinds.get(order["batch"]["tier"], _runs)
    for begun, record in made(campaign, folder, order):
        _say("begun", asdict(begun))
        _say("ended", asdict(record()))
    _say("costs", {"cpu_seconds": process_time(), "peak_memory_mb": peak_memory_mb(), "sources": sources})


def _runs(campaign: Campaign, folder: CampaignFolder, order: dict[str, Any]) -> Iterator[Task]:
    """Yield the runs of a batch that are to be made."""
    from coop_drake.campaign.batches import Batching
    from coop_drake.campaign.plans import Plans
    from coop_drake.campaign.running.making import RunMaker
    from coop_drake.campaign.variation import Variation

    batch, variation = order["batch"], Variation(campaign)
    plans = Plans(variation, folder.plans)
    place = batch["scenario"], batch["tier"], batch["first"], batch["stop"]
    _compare(order, Batching(variation, plans).batch(*place))
    maker = RunMaker(variation, plans, batch["tier"], folder.path / "logs")
    for index in range(order["begin"], batch["stop"]):
        run = variation.run(index)
        yield maker.begun(run), partial(maker.record, run)


def _searches(campaign: Campaign, folder: CampaignFolder, order: dict[str, Any]) -> Iterator[Task]:
    """Yield the searches or bisections of a batch that are to be made."""
    from coop_drake.campaign.search.searching import Searching

    batch = order["batch"]
    alive = partial(_say, "alive", None)
    searching = Searching(campaign, folder, batch["tier"], batch["scenario"], alive)
    _compare(order, searching.batch(batch["first"], batch["stop"]))
    for index in range(order["begin"], batch["stop"]):
        yield searching.begun(index), partial(searching.record, index)


def _compare(order: dict[str, Any], batch: Batch) -> None:
    """Check that what files say now gives the batch that was ordered."""
    if batch.digest != order["batch"]["digest"]:
        raise CoopDrakeError(f"{order['campaign']}: a scenario or a model was changed while the campaign ran")


def _questions(campaign: Campaign, folder: CampaignFolder, order: dict[str, Any]) -> Iterator[Task]:
    """Yield the questions of a batch that are to be answered; kernels are loaded before their time counts."""
    from coop_drake.campaign.questions import ask, begun_question
    from coop_drake.planning import warm_up

    settings = campaign.questions
    assert settings is not None  # or there would be no batches
    warm_up.main()
    for number in range(order["begin"], order["batch"]["stop"]):
        yield begun_question(settings, number), partial(ask, number, settings, folder.cases)


def _say(kind: str, content: object) -> None:
    sys.stdout.write(json.dumps([kind, content]) + "\n")
    sys.stdout.flush()


def _end_with_supervisor(scratch: str) -> None:
    """End this process, and remove its files, when the one that started it has ended, however that was."""
    os.read(sys.stdin.fileno(), 1)  # It returns when no process can write any more.
    shutil.rmtree(scratch, ignore_errors=True)
    os._exit(1)


if __name__ == "__main__":
    sys.exit(main(json.loads(sys.argv[1])))
