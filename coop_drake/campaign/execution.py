"""Has the runs of a batch made by a disposable process, and writes their records."""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import IO, Any

from coop_drake.campaign.batches import Batch
from coop_drake.campaign.plans import source_digest
from coop_drake.campaign.records import Record
from coop_drake.campaign.results import CampaignFolder
from coop_drake.errors import ProcessError

_ATTEMPTS = 3
"""How many processes try a run before it counts as lost: one may be killed, or starve, by no fault of it."""

_START = 600.0
"""How much longer a process may take until its first run has ended [s]: it reads models and maps, and may
have to compile all kernels, on a busy machine."""


_COMMAND = (sys.executable, "-m", "coop_drake.campaign.running.child")
"""Starts a process that makes runs; what it shall make is one more argument."""


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


class _LostError(Exception):
    """A process ended, or was ended, before it was done; with the record of the run it was at, if any."""

    def __init__(self, reason: str, begun: Record | None) -> None:
        super().__init__(reason)
        self.begun = begun


def make_batch(order: Order) -> bool:
    """Make a batch, unless its file is there; return whether it was made.

    A run at which several processes were lost is recorded as lost; the others are made all the same.

    Raises:
        ProcessError: No process can start, or what it is to make has changed.
        OSError: The records cannot be written.
    """
    folder, batch = CampaignFolder(Path(order.folder)), order.batch
    if folder.has(batch):
        return False
    records: list[Record] = []
    costs: dict[str, Any] = {"runs": batch.stop - batch.first, "cpu_seconds": 0.0, "peak_memory_mb": 0.0}
    costs |= {"lost_processes": 0, "sources": source_digest()}
    failures = 0
    while len(records) < batch.stop - batch.first:
        try:
            for kind, content in _lines(order, batch.first + len(records)):
                if kind == "ended":
                    records.append(batch.record(**content))
                    failures = 0
                else:
                    costs["cpu_seconds"] += content["cpu_seconds"]
                    costs["peak_memory_mb"] = max(costs["peak_memory_mb"], content["peak_memory_mb"])
                    costs["sources"] = content["sources"]
        except _LostError as lost:
            failures += 1
            costs["lost_processes"] += 1
            if failures < _ATTEMPTS:
                continue
            if lost.begun is None:
                raise ProcessError(f"no process for runs could start: {lost}") from lost
            records.append(replace(lost.begun, reason=str(lost)))
            failures = 0
    folder.write(batch, records)
    folder.note(batch, costs)
    return True


def _lines(order: Order, begin: int) -> Iterator[tuple[str, Any]]:
    """Yield what a process says of the runs from an index on: ``ended`` and ``costs`` with their content.

    Raises:
        _LostError: It ended before it was done, or took too long, and was ended.
        ProcessError: It says that it cannot run what it was told.
    """
    begun: Record | None = None
    pipe = subprocess.PIPE
    with (
        tempfile.TemporaryFile() as errors,
        tempfile.TemporaryDirectory() as scratch,  # A process that is killed leaves files in it.
        subprocess.Popen(
            [*_COMMAND, json.dumps({**asdict(order), "begin": begin, "scratch": scratch})],
            stdin=pipe,
            stdout=pipe,
            stderr=errors,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},  # It finds the same.
        ) as process,
    ):
        assert process.stdout is not None  # it is a pipe
        try:
            for line in _timely(process.stdout, order.time_limit):
                kind, content = json.loads(line)
                if kind == "error":
                    raise ProcessError(content)
                if kind == "alive":
                    continue
                if kind == "begun":
                    begun = order.batch.record(**content)
                    continue
                begun = None
                yield kind, content
                if kind == "costs":
                    return
        except TimeoutError:
            raise _LostError(f"no result within {order.time_limit:g} s", begun) from None
        finally:
            process.kill()
        raise _LostError(_end_of(process.wait(), errors), begun)


def _timely(stream: IO[bytes], time_limit: float) -> Iterator[bytes]:
    """Yield the lines of a stream, of which the second says that the first run has ended.

    Raises:
        TimeoutError: The next one has not come in time.
    """
    rest, seen = b"", 0
    with selectors.DefaultSelector() as selector:
        selector.register(stream, selectors.EVENT_READ)
        while selector.select(time_limit if seen >= 2 else time_limit + _START):
            part = os.read(stream.fileno(), 1 << 16)
            if not part:
                return
            *lines, rest = (rest + part).split(b"\n")
            seen += len(lines)
            yield from lines
    raise TimeoutError


def _end_of(code: int, errors: IO[bytes]) -> str:
    """Say how a process ended, with the last line that it wrote."""
    errors.seek(0)
    said = errors.read().decode(errors="replace").strip().splitlines()[-1:]
    how = f"by signal {signal.Signals(-code).name}" if code < 0 else f"with code {code}"
    return ": ".join([f"the process ended {how}", *said])
