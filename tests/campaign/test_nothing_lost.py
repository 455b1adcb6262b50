"""Whatever is killed, hangs or is full: a campaign goes on, or the same command does, to the same bytes."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeVar

import pytest

from coop_drake.campaign.execution import Order, _locked, make_batch, make_batches
from coop_drake.campaign.file import load_campaign
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.records import Batch, Batching, CampaignFolder, write_table
from coop_drake.campaign.runs import RunMaker
from coop_drake.campaign.variation import Variation
from coop_drake.errors import CoopDrakeError, ScenarioError
from tests.support.scenarios import write_scenario

T = TypeVar("T")

_PATIENCE = 300.0
"""Longest that a test waits [s]; machines are busy where tests run."""


class Process(NamedTuple):
    """A running process.

    Attributes:
        pid: Its number.
        parent: The number of the process that started it.
        command: Its arguments.
    """

    pid: int
    parent: int
    command: str


def processes(*words: str) -> list[Process]:
    """The running processes whose arguments have all of the words; not those that have ended."""
    lines = subprocess.run(
        ["ps", "-A", "-ww", "-o", "pid=,ppid=,stat=,args="], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    rows = [line.split(maxsplit=3) for line in lines]
    return [
        Process(int(row[0]), int(row[1]), row[3])
        for row in rows
        if len(row) == 4 and not row[2].startswith("Z") and all(word in row[3] for word in words)
    ]


def waited_for(what: Callable[[], T]) -> T:
    """What a function returns as soon as it is true."""
    end = time.monotonic() + _PATIENCE
    while time.monotonic() < end:
        if found := what():
            return found
        time.sleep(0.02)
    raise AssertionError("nothing came in time")


def kill(pid: int, number: int = signal.SIGKILL) -> None:
    """Send a signal to a process that may have ended."""
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return


pytestmark = pytest.mark.slow

RUNS, BATCH = 12, 2
FILE = f"""
runs:
  scenarios: [room.scenario.yaml]
  count: {RUNS}
  batch: {BATCH}
  vary:
    deployment.mass_error: !Uniform {{min: -0.1, max: 0.1}}
"""
PATIENCE = 300.0
"""Longest that a command is waited for [s]; machines are busy where tests run."""

PROGRAM = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # It is ignored where tests run in the background.
from coop_drake.entry_point import main
main()
"""


class Undisturbed:
    """A campaign whose runs were made one after another in this process, and its files."""

    def __init__(self, folder: Path) -> None:
        write_scenario(folder / "room.scenario.yaml")
        self.file = folder / "room.campaign.yaml"
        self.file.write_text(FILE)
        self.variation = Variation(load_campaign(self.file))
        self.folder = CampaignFolder(folder / "undisturbed")
        self.plans = Plans(self.variation, self.folder.plans)
        maker = RunMaker(self.variation, self.plans, "drake", folder / "logs")
        self.batches = tuple(Batching(self.variation, self.plans).batches())
        for batch in self.batches:
            self.folder.write(
                batch, map(maker.record, map(self.variation.run, range(batch.first, batch.stop)))
            )

    def files(self, folder: CampaignFolder) -> dict[str, bytes]:
        """What a folder holds of runs."""
        return {path.name: path.read_bytes() for path in folder.path.glob("runs/*")}

    def missing(self, folder: CampaignFolder) -> bool:
        """Whether batches are to be made yet; those that are there are as they should be."""
        assert self.files(folder).items() <= self.files(self.folder).items()
        return len(folder.missing(self.batches)) > 0

    def order(self, folder: Path, index: int = 0, time_limit: float = 60.0) -> Order:
        """An order for one of the batches, in a folder of its own."""
        made = CampaignFolder(folder)
        folder.mkdir(exist_ok=True)
        made.campaign.write_bytes(self.file.read_bytes())
        shutil.copytree(self.folder.plans, made.plans)
        return Order(str(self.file), str(folder), self.batches[index], time_limit)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    return Undisturbed(tmp_path_factory.mktemp("undisturbed"))


@pytest.fixture
def begun(undisturbed):
    """Starts the command in a process of its own, which Ctrl-C and limits can be sent to."""
    with ExitStack() as stack:

        def start(folder, *arguments, file=undisturbed.file, **options):
            words = [sys.executable, "-c", PROGRAM, "campaign", file, "--out", folder, *arguments]
            pipes = dict.fromkeys(("stdout", "stderr"), subprocess.PIPE)
            process = subprocess.Popen(list(map(str, words)), text=True, **pipes, **options)
            stack.enter_context(process)
            stack.callback(process.kill)
            return process

        yield start


def sorted_bytes(folder, campaign):
    """The sorted table of a campaign as one file."""
    path = folder.path / "sorted.parquet"
    write_table(path, folder.table(campaign.batches))
    return path.read_bytes()


def worker_of(folder, *, but=()):
    """The number of a worker of a command, when it makes runs; what earlier workers tried is gone by then."""

    def found():
        pids = [pid for pid in workers_of(folder) if pid not in but]
        return pids if any((folder.path / "attempts").glob("*")) else []

    return waited_for(found)[0]


def workers_of(folder):
    """The processes that a command has started for the runs of a folder."""
    commands = {p.pid for p in processes(str(folder.path))}
    return [p.pid for p in processes("multiprocessing.spawn", "spawn_main") if p.parent in commands]


def gone(*pids):
    """Whether processes have ended."""
    return not {p.pid for p in processes()} & set(pids)


def ended(command, folder, number):
    """End a command by a signal, and wait for all of its processes."""
    pids = workers_of(folder)
    command.send_signal(number)
    _, said = command.communicate(timeout=PATIENCE)
    assert (command.returncode, "leaked" in said) == (128 + number, False), said
    waited_for(lambda: not processes(str(folder.path)) and gone(*pids))


def test_a_campaign_that_is_disturbed_in_every_way_ends_as_one_that_is_not(undisturbed, begun):
    folder = CampaignFolder(undisturbed.folder.path.with_name("disturbed"))
    undisturbed.order(folder.path)

    first = begun(folder.path, "--workers", 1)
    worker = worker_of(folder)
    kill(worker)
    waited_for(lambda: gone(worker))
    worker_of(folder, but=[worker])
    ended(first, folder, signal.SIGINT)
    assert undisturbed.missing(folder)

    second = begun(folder.path, "--workers", 1)
    worker_of(folder)
    ended(second, folder, signal.SIGTERM)
    assert undisturbed.missing(folder)

    third = begun(folder.path, "--workers", 1)
    worker = worker_of(folder)
    kill(third.pid)
    third.communicate()
    waited_for(lambda: not processes(str(folder.path)) and gone(worker))
    assert undisturbed.missing(folder)

    quick = {**os.environ, "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "8s"}
    last = begun(folder.path, "--json", "--workers", 2, env=quick)
    hanging = worker_of(folder)
    kill(hanging, signal.SIGSTOP)
    said, _ = last.communicate(timeout=PATIENCE)
    kill(hanging)
    assert last.returncode == 0, said
    facts = json.loads(said)
    assert (facts["done"], facts["lost"]) == (RUNS, 0)
    assert undisturbed.files(folder) == undisturbed.files(undisturbed.folder)
    assert len(undisturbed.files(folder)) == RUNS // BATCH
    assert sorted_bytes(folder, undisturbed) == sorted_bytes(undisturbed.folder, undisturbed)


def test_a_scheduler_of_the_users_own_may_be_killed(undisturbed, begun, tmp_path):
    folder = CampaignFolder(undisturbed.folder.path.with_name("elsewhere"))
    place = tmp_path / "scheduler.json"
    own = {"stderr": subprocess.DEVNULL, "env": {**os.environ, "DASK_TEMPORARY_DIRECTORY": str(tmp_path)}}
    dask = [sys.executable, "-m", "distributed.cli.dask_"]
    options = ["--host", "127.0.0.1", "--no-dashboard"]
    start = [*dask[:-1], f"{dask[-1]}scheduler", *options, "--port", "0", "--scheduler-file", str(place)]
    scheduler = subprocess.Popen(start, **own)
    address = waited_for(lambda: place.exists() and json.loads(place.read_text() or "{}").get("address"))
    work = [*dask[:-1], f"{dask[-1]}worker", address, *options, "--no-nanny", "--nthreads", "1"]
    worker = subprocess.Popen(work, **own)
    try:
        command = begun(folder.path, "--scheduler", address)
        waited_for(lambda: any((folder.path / "attempts").glob("*")))
        kill(scheduler.pid)
        _, said = command.communicate(timeout=PATIENCE)
        assert command.returncode == 1, said
        assert "the same command goes on from here" in said
    finally:
        for process in (scheduler, worker):
            kill(process.pid)
            process.wait()
    waited_for(lambda: not processes(str(folder.path)))
    assert undisturbed.missing(folder)


def fatal(folder, stop):
    """A batch of work in which pieces hang and end their process, in a folder of its own."""
    return CampaignFolder(folder), Batch(
        0, "compiled", 0, stop, f"{stop:064}", "tests.support.fatal_work:WORK"
    )


def made(folder, batch):
    file = folder.path.with_name("work.yaml")
    file.write_text("")
    options = {"workers": 1, "scheduler": None, "progress": None}
    return make_batches(file, folder, (batch,), lambda missing: None, lambda batch: 1.0, **options)


def test_two_commands_do_not_work_in_one_folder(tmp_path):
    folder, batch = fatal(tmp_path / "locked", 1)
    with _locked(folder), pytest.raises(ScenarioError, match="a folder in which no other command works"):
        made(folder, batch)
    assert made(folder, batch).made == 1


def test_pieces_that_hang_or_end_every_process_are_recorded_as_lost_and_the_others_are_made(
    tmp_path,
):
    folder, batch = fatal(tmp_path / "fatal", 4)
    assert made(folder, batch).made == 1
    assert made(folder, batch).made == 0  # Its file is there.
    rows = folder.table([batch]).to_pylist()
    assert [row["arrived"] for row in rows] == [True, False, False, True]
    said = "no result within 1 s, or the process was ended, 3 times"
    assert [row["reason"] for row in rows] == ["", said, said, ""]
    assert folder.costs([batch])[0]["lost_processes"] == 6


def test_a_disk_that_is_full_ends_the_command_and_loses_no_piece(tmp_path):
    folder, batch = fatal(tmp_path / "full", 5)
    batch = replace(batch, first=3)
    with pytest.raises(OSError, match="the disk is full"):
        made(folder, batch)
    assert folder.missing([batch]) == [batch]


def test_a_scenario_that_was_changed_meanwhile_is_not_run(undisturbed, tmp_path):
    order = undisturbed.order(tmp_path / "changed")
    changed = CampaignFolder(tmp_path / "changed").campaign
    changed.write_text(changed.read_text().replace("max: 0.1", "max: 0.2"))
    with pytest.raises(CoopDrakeError, match="was changed while the campaign ran"):
        make_batch(order)
