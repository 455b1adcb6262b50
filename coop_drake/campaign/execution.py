"""Runs a campaign from its file to its results, or the rest of one that was interrupted, by Dask.

A batch is a task of Dask, on a cluster of this machine alone or on one that exists. A worker that hangs is
ended by the alarm of the system, one that takes too much memory by its nanny; the nanny starts another one,
and Dask gives it the batch again. A run at which several workers were lost counts as lost; the others are
made.
"""

from __future__ import annotations

import fcntl
import logging
import os
import shutil
import signal
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from itertools import islice
from pathlib import Path
from pkgutil import resolve_name
from threading import Lock
from time import process_time
from typing import TYPE_CHECKING, cast

from coop_drake.campaign.file import Campaign, Tier
from coop_drake.campaign.plans import Plans, source_digest
from coop_drake.campaign.records import Batch, Batching, CampaignFolder, Record, work_of
from coop_drake.campaign.runs import RunMaker
from coop_drake.campaign.variation import Variation
from coop_drake.errors import ProcessError, ScenarioError
from coop_drake.files import write_atomically
from coop_drake.interrupts import ended_by_signals, uninterrupted
from coop_drake.memory import peak_memory_mb
from coop_drake.progress import Progress

if TYPE_CHECKING:
    from distributed import Client

_ATTEMPTS = 3
"""How many workers try a run before it counts as lost: one may be killed, or starve, by no fault of it."""

_START = 600.0
"""How much longer a worker may take until its first run has ended [s]: it reads models and maps, and may have
to compile all kernels, on a busy machine."""

_WAITING = 1000
"""Batches that the scheduler holds at a time: it keeps some kilobytes of each."""

_PORTS = 2**16
"""Ports have smaller numbers."""

_SETTINGS = {
    "distributed": {
        "scheduler": {"allowed-failures": 100, "worker-ttl": "30s"},
        "worker": {
            "profile": {"enabled": False},
            "memory": {"target": False, "spill": False, "pause": False, "terminate": 0.95},
        },
        "deploy": {"lost-worker-timeout": "1h"},
        "admin": {"tick": {"interval": "500ms"}, "system-monitor": {"interval": "5s"}},
    }
}
"""A batch is tried again when its worker was lost, and given to another worker after a minute at most in
which its own was silent: Dask looks every half minute which workers have been silent for as long. Drake keeps
17 MB of a hundred runs: a worker that has no memory left is ended and another one started. A nanny is not
given up because the worker that it starts is lost once more before Dask looks, after 15 s by default. Dask's
measurements of itself are off or rare: scheduler and two workers would use a seventh of a core for them. The
user's own settings in Dask's configuration stand above these where they differ from Dask's defaults."""

_ONE_BATCH = Lock()
"""Held while this process makes a batch: it has one alarm."""


@dataclass(frozen=True)
class Order:
    """A batch that is to be made.

    Attributes:
        campaign: The file, against which the names of scenarios are resolved.
        folder: The folder of the results, which every worker must see under this name.
        batch: The batch.
        time_limit: Longest that a run may take, or other work without a sign of life [s].
    """

    campaign: str
    folder: str
    batch: Batch
    time_limit: float


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


def make_batch(order: Order) -> bool:
    """Make a batch, unless its file is there; return whether it was made.

    The system ends this process if a run takes longer than the order allows. Before a run is made, its index
    is written to a file: who makes the batch again knows at which runs others were lost.

    Raises:
        CoopDrakeError: What the batch is made from has changed.
        OSError: The records cannot be written.
    """
    folder, batch = CampaignFolder(Path(order.folder)), order.batch
    with _ONE_BATCH:
        if folder.has(batch):
            return False
        trace = folder.path / "attempts" / batch.digest
        trace.parent.mkdir(parents=True, exist_ok=True)
        lost = [int(line) for line in trace.read_text().split()] if trace.exists() else []
        sources, begin = source_digest(), process_time()
        records: list[Record] = []

        def alive() -> None:
            signal.setitimer(signal.ITIMER_REAL, order.time_limit)

        signal.setitimer(signal.ITIMER_REAL, order.time_limit + _START)
        try:
            tasks = resolve_name(work_of(batch.work).tasks)
            for begun, make in tasks({**asdict(order), "begin": batch.first}, alive):
                index = batch.first + len(records)
                if lost.count(index) >= _ATTEMPTS:
                    within = f"no result within {order.time_limit:g} s, or the process was ended"
                    records.append(replace(begun, reason=f"{within}, {_ATTEMPTS} times"))
                    continue
                trace.write_text("\n".join(map(str, [*lost, index])))
                records.append(make())
                alive()
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        folder.write(batch, records)
        costs = {"runs": len(records), "cpu_seconds": process_time() - begin, "sources": sources}
        folder.note(batch, {**costs, "peak_memory_mb": peak_memory_mb(), "lost_processes": len(lost)})
        trace.unlink(missing_ok=True)
    return True


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
        """Make the plans, which workers find in the folder, and check the runs."""
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
    """Make the batches whose results are not there yet.

    Args:
        file: What says what they are; workers read the copy of it in the folder.
        folder: Where results go.
        batches: All of them.
        prepare: Called with those that are not there, before any is made; what it raises ends the call.
        time_limit: Longest that a worker may take for a piece of a batch, or between signs of life [s].
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
        there, done = len(batches) - len(missing), 0
        shutil.rmtree(folder.path / "attempts", ignore_errors=True)  # Who interrupts a run does not lose it.
        orders = [Order(str(file.absolute()), str(folder.path), one, time_limit(one)) for one in missing]
        for done, _ in enumerate(_made(orders, workers, scheduler) if orders else (), start=1):
            advance(f"{there + done} of {len(batches)} batches", (there + done) / len(batches))
        return Outcome(folder, batches, done)


def _made(orders: Sequence[Order], workers: int | None, scheduler: str | None) -> Iterator[Batch]:
    """Yield each batch when its file is there.

    Raises:
        ProcessError: Workers or the scheduler were lost for good.
        OSError: Records cannot be written.
    """
    import distributed

    waiting, batches = iter(orders), {f"batch-{order.batch.digest}": order.batch for order in orders}
    with client_of(workers, scheduler) as client:

        def submit(order: Order) -> distributed.Future:
            return client.submit(make_batch, order, key=f"batch-{order.batch.digest}", pure=False)

        futures = distributed.as_completed([submit(order) for order in islice(waiting, _WAITING)])
        for future in futures:
            try:
                future.result()
            except (distributed.KilledWorker, distributed.CancelledError) as error:
                where = f"at {scheduler}" if scheduler else "of this command"
                raise ProcessError(
                    f"workers {where} were lost; the same command goes on from here"
                ) from error
            yield batches[future.key]
            for order in islice(waiting, 1):
                futures.add(submit(order))


def check_scheduler(address: str) -> None:
    """Refuse an address that no scheduler can have.

    Raises:
        ScenarioError: It has no host, no port, or begins with what Dask does not know.
    """
    from distributed.comm import parse_address, parse_host_port
    from distributed.comm.registry import get_backend

    allowed = "the address of a Dask scheduler, such as tcp://192.168.0.1:8786"
    try:
        scheme, location = parse_address(address)
        host, port = parse_host_port(location)
        get_backend(scheme)
    except (ValueError, AssertionError) as error:
        said = f"{allowed} ({error})" if str(error) else allowed
        raise ScenarioError("the options", "--scheduler", address, said) from error
    if not host or not 0 < int(port) < _PORTS:
        raise ScenarioError("the options", "--scheduler", address, allowed)


@contextmanager
def client_of(workers: int | None, scheduler: str | None) -> Iterator[Client]:
    """Connect to a scheduler, or start one with workers that end with the block."""
    import dask
    import distributed

    if scheduler is not None:
        with distributed.Client(scheduler) as client:
            yield client
        return
    dask.config.update_defaults(_SETTINGS)
    # Connections that close with the cluster are no news; what silences their logs ends before they do.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        with uninterrupted():  # Ctrl-C is for this process, which ends the others.
            cluster = distributed.LocalCluster(
                n_workers=workers or os.cpu_count() or 1,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",  # Dask serves something in any case; no port is taken twice.
                scheduler_kwargs={"dashboard": False},
                local_directory=scratch,
                silence_logs=50,
            )
            client = distributed.Client(cluster)
        with ended_by_signals(), cluster, client:
            try:
                yield client
            finally:  # Dask would wait for batches that are being made, and nannies start new workers.
                for nanny in cluster.workers.values():
                    nanny.close_gracefully()
                for process in [nanny.pid for nanny in cluster.workers.values() if nanny.pid]:
                    with suppress(ProcessLookupError):
                        os.kill(process, signal.SIGKILL)


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
