"""What a campaign costs besides its runs: placing batches, starting processes, files; memory of a worker."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from resource import getpagesize
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

from benchmarks.isolated import WorkerError, in_own_process
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake.campaign import load_campaign
from coop_drake.campaign.execution import Order, client_of, make_batch, run_campaign
from coop_drake.campaign.file import Tier
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.records import Batch, Batching, CampaignFolder
from coop_drake.campaign.variation import Variation

__all__ = ["campaign_tasks", "placing", "worker_memory"]

_EMPTY = 2000
"""Batches of which nothing is made."""
_RUNS = 2000
"""Runs after which the memory of a worker is looked at."""
_LIMIT = 1800.0
"""Longest that these may take [CPU s]; they take some minutes."""
_SHORT = """
runs:
  scenarios: [base]
  count: {count}
  batch: {batch}
  set:
    goal.object: {{x: 0.9, y: 2.3, theta: 1.6}}
    goal.joints: {{}}
    deployment.control_rate: 200
  vary: {{deployment.mass_error: !Uniform {{min: -0.1, max: 0.1}}}}
  tier: {tier}
  paired: 0
"""
"""A transport of two seconds, so that what is not simulation shows; sampled, because both tiers know that."""
_SHARE = 0.01
"""What starting a process may add to the processor time of a batch [-]."""
_OVERHEAD, _START, _RUN = (
    "campaign/scheduler/empty_batch/cpu",
    "campaign/batches/process/start",
    "campaign/batches/process/run",
)
"""Names of rows from which others follow."""


def campaign_tasks() -> list[Task]:
    """The scheduler with empty tasks; processes, files, one and two workers; memory over many runs."""
    return [
        Task("campaign/scheduler", lambda rows: placing(), alone=True),
        Task("campaign/batches", lambda rows: _batches(), alone=True),
        Task("campaign/cluster", _cluster, alone=True),
        Task("campaign/workers", lambda rows: _workers(), alone=True),
        Task("campaign/memory", lambda rows: _memory()),
    ]


def placing(batches: int = _EMPTY) -> Sequence[Row]:
    """Processor time of the command, which holds the scheduler, for a batch of which nothing is made."""
    with client_of(2, None) as client:
        client.gather(client.map(_nothing, range(2), pure=False))
        spent, began = process_time(), perf_counter()
        client.gather(client.map(_nothing, range(batches), pure=False))
        spent, began = process_time() - spent, perf_counter() - began
    wall = "campaign/scheduler/empty_batch/wall"
    return [Row(_OVERHEAD, 1e3 * spent / batches, "ms"), Row(wall, 1e3 * began / batches, "ms")]


def _nothing(index: int) -> None:
    """A task that does nothing."""


def _batches() -> Sequence[Row]:
    """What processes and files cost: from batches of 1, 5 and 100 runs."""
    rows, seconds = [], {}
    for size in (1, 5, 100):
        with _campaign(size, size) as (folder, orders):
            make_batch(orders[0])
            seconds[size] = folder.costs([orders[0].batch])[0]["cpu_seconds"]
            content = (folder.path / orders[0].batch.file).stat().st_size
        rows.append(Row(f"campaign/batches/of_{size}/bytes_a_run", content / size, "bytes"))
    run = (seconds[100] - seconds[1]) / 99
    return [
        *rows,
        Row(_START, seconds[1] - run, "CPU s"),
        Row(_RUN, run, "CPU s"),
    ]


def _cluster(rows: Sequence[Row]) -> Sequence[Row]:
    """The batch of which starting is a small share, and how many cores a scheduler then feeds, on paper."""
    known = {row.name: row.value for row in rows}
    if not known.keys() >= {_OVERHEAD, _START}:
        raise WorkerError(f"what follows from {_OVERHEAD} and {_START} needs these: measure them first")
    batch = known[_START] / _SHARE
    name = f"campaign/cluster/start_is_{_SHARE:.0%}"
    return [
        Row(f"{name}/batch", batch, "CPU s"),
        Row(f"{name}/largest_cluster", batch / (1e-3 * known[_OVERHEAD]), "cores"),
    ]


def _workers() -> Sequence[Row]:
    """How much quicker two workers are than one, in runs a second; the machine must have two idle cores."""
    seconds = {}
    for workers in (1, 2):
        with _campaign(400, 50) as (folder, orders):
            began = perf_counter()
            run_campaign(load_campaign(orders[0].campaign), folder.path, workers=workers)
            seconds[workers] = perf_counter() - began
    efficiency = seconds[1] / (2.0 * seconds[2])
    return [Row("campaign/workers/two/efficiency", efficiency, "of twice one worker")]


def worker_memory(runs: int = _RUNS, batch: int = 100) -> list[float]:
    """Resident memory of a worker after every batch of so many runs of the compiled loop [MB]."""
    sizes = []
    with _campaign(runs, batch, "compiled") as (_, orders):
        for order in orders:
            make_batch(order)
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            sizes.append(1e-6 * pages * getpagesize())
    return sizes


def _memory() -> Sequence[Row]:
    sizes = in_own_process(worker_memory, limit=_LIMIT).value
    name = f"campaign/memory/worker_over_{_RUNS}_runs"
    known = [] if sizes is None else [("first_batch", sizes[0]), ("last_batch", sizes[-1])]
    return [Row(f"{name}/{figure}", size, "MB") for figure, size in known]


@contextmanager
def _campaign(count: int, batch: int, tier: Tier = "drake") -> Iterator[tuple[CampaignFolder, list[Order]]]:
    """A campaign of short runs in a folder of its own, planned, with its batches."""
    with TemporaryDirectory() as place:
        file = Path(place) / "short.campaign.yaml"
        file.write_text(_SHORT.format(count=count, batch=batch, tier=tier))
        variation = Variation(load_campaign(file))
        folder = CampaignFolder(Path(place) / "out")
        plans = Plans(variation, folder.plans)
        plans.with_maps(variation.run(0))
        folder.campaign.write_bytes(file.read_bytes())
        batches: list[Batch] = list(Batching(variation, plans).batches())
        yield folder, [Order(str(file), str(folder.path), one, 60.0) for one in batches]
