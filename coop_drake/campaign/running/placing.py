"""Places batches on workers by Dask: on a cluster of this machine alone, or on one that exists."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import islice
from typing import TYPE_CHECKING

from coop_drake.campaign.batches import Batch
from coop_drake.campaign.running.supervising import Order, make_batch
from coop_drake.errors import ProcessError, ScenarioError
from coop_drake.interrupts import ended_by_signals, uninterrupted

if TYPE_CHECKING:
    from distributed import Client

_WAITING = 1000
"""Batches that the scheduler holds at a time: it keeps some kilobytes of each."""

_PORTS = 2**16
"""Ports have smaller numbers."""

_SETTINGS = {
    "distributed": {
        "scheduler": {"allowed-failures": 100, "worker-ttl": "30s"},
        "worker": {"profile": {"enabled": False}},
        "admin": {"tick": {"interval": "500ms"}, "system-monitor": {"interval": "5s"}},
    }
}
"""A batch is tried again when its worker was lost, and given to another worker after a minute at most in
which its own was silent: Dask looks every half minute which workers have been silent for as long. Its
measurements of itself are off or rare: scheduler and two workers would use a seventh of a core for them.
The user's own settings in Dask's configuration stand above these where they differ from Dask's defaults."""


def place(
    orders: Sequence[Order], workers: int | None, scheduler: str | None, done: Callable[[Batch], None]
) -> None:
    """Have batches made, and say which is done.

    Args:
        orders: The batches.
        workers: How many are made at a time on this machine; one a core by default.
        scheduler: Address of a scheduler that exists, with workers of its own; else a cluster is started
            here, reachable from this machine alone, and ended with this call.
        done: Called with every batch whose file is there.

    Raises:
        ProcessError: Workers or the scheduler were lost for good.
        OSError: Records cannot be written.
    """
    import distributed

    waiting = iter(orders)
    with client_of(workers, scheduler) as client:

        def submit(order: Order) -> distributed.Future:
            return client.submit(make_batch, order, key=f"batch-{order.batch.digest}", pure=False)

        batches = {f"batch-{order.batch.digest}": order.batch for order in orders}
        futures = distributed.as_completed([submit(order) for order in islice(waiting, _WAITING)])
        for future in futures:
            try:
                future.result()
            except (distributed.KilledWorker, distributed.CancelledError) as error:
                where = f"at {scheduler}" if scheduler else "of this command"
                raise ProcessError(
                    f"workers {where} were lost; the same command goes on from here"
                ) from error
            done(batches[future.key])
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
    with uninterrupted():  # Ctrl-C is for this process, which ends the others.
        cluster = distributed.LocalCluster(
            n_workers=workers or os.cpu_count() or 1,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",  # Dask serves something in any case; no port is taken twice.
            scheduler_kwargs={"dashboard": False},
            memory_limit=0,  # Runs use their memory in processes that the workers start.
            silence_logs=50,
        )
        client = distributed.Client(cluster)
    with ended_by_signals(), cluster, client:
        try:
            yield client
        finally:  # Dask waits for batches that are being made; their processes end with their workers.
            for process in [worker.pid for worker in cluster.workers.values() if worker.pid]:
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
