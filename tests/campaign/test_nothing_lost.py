"""Whatever is killed, hangs or is full: a campaign goes on, or the same command does, to the same bytes."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from coop_drake.campaign.batches import Batching
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.results import CampaignFolder, write_table
from coop_drake.campaign.running import Order, make_batch, supervising
from coop_drake.campaign.running.making import RunMaker
from coop_drake.campaign.settings import load_campaign
from coop_drake.campaign.variation import Variation
from coop_drake.errors import ProcessError
from tests.support.processes import kill, processes, waited_for
from tests.support.scenarios import write_scenario

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

CHILD = "coop_drake.campaign.running.child"
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


def child_of(folder, *, but=()):
    """A process that makes runs for a folder, when there is one."""
    return waited_for(lambda: [p for p in processes(CHILD, str(folder)) if p.pid not in but])[0]


def ended(command, folder, number):
    """End a command by a signal, and wait for all of its processes."""
    command.send_signal(number)
    _, said = command.communicate(timeout=PATIENCE)
    assert (command.returncode, "leaked" in said) == (128 + number, False), said
    waited_for(lambda: not processes(str(folder.path)))


def test_a_campaign_that_is_disturbed_in_every_way_ends_as_one_that_is_not(undisturbed, begun):
    folder = CampaignFolder(undisturbed.folder.path.with_name("disturbed"))
    undisturbed.order(folder.path)  # The plans are there: they would not fit where a disk is full.

    small = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (5000, resource.RLIM_INFINITY))}
    full = begun(folder.path, "--workers", 1, **small)
    _, said = full.communicate(timeout=PATIENCE)
    assert full.returncode == 2, said
    assert "file too large" in said
    assert undisturbed.files(folder) == {}

    first = begun(folder.path, "--workers", 2)
    child = child_of(folder.path)
    kill(child.pid)
    child = child_of(folder.path, but=[child.pid])
    kill(child.parent)  # the worker, with which its process ends
    waited_for(lambda: child.pid not in {p.pid for p in processes(CHILD)})
    child_of(folder.path, but=[child.pid])
    ended(first, folder, signal.SIGINT)
    assert undisturbed.missing(folder)

    second = begun(folder.path, "--workers", 1)
    child_of(folder.path)
    beside = begun(folder.path)
    _, said = beside.communicate(timeout=PATIENCE)
    assert beside.returncode == 2
    assert "a folder in which no other command works" in said
    ended(second, folder, signal.SIGTERM)
    assert undisturbed.missing(folder)

    third = begun(folder.path, "--workers", 1)
    child_of(folder.path)
    kill(third.pid)
    third.communicate()
    waited_for(lambda: not processes(str(folder.path)))
    assert undisturbed.missing(folder)

    quick = {**os.environ, "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "5s"}
    last = begun(folder.path, "--json", "--workers", 2, env=quick)
    hanging = child_of(folder.path).parent  # a worker again
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
        child_of(folder.path)
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


def test_a_process_that_hangs_is_ended_and_another_goes_on(undisturbed, tmp_path, monkeypatch):
    timely, limits = supervising._timely, iter([2.0])
    monkeypatch.setattr(supervising, "_START", 0.0)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(supervising, "_timely", lambda stream, limit: timely(stream, next(limits, limit)))
    order = undisturbed.order(tmp_path / "hanging", time_limit=PATIENCE)  # of all processes but the first
    stopping = threading.Thread(target=lambda: kill(child_of(order.folder).pid, signal.SIGSTOP))
    stopping.start()
    assert make_batch(order)
    stopping.join()
    folder = CampaignFolder(Path(order.folder))
    assert folder.costs([order.batch])[0]["lost_processes"] >= 1
    assert list((tmp_path / "temporary").iterdir()) == []
    assert (folder.path / order.batch.file).read_bytes() == (
        undisturbed.folder.path / order.batch.file
    ).read_bytes()


def test_a_process_removes_its_files_when_what_started_it_has_ended(undisturbed, tmp_path):
    (scratch := tmp_path / "scratch").mkdir()
    told = {**asdict(undisturbed.order(tmp_path / "left")), "begin": 0, "scratch": str(scratch)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, "-m", CHILD, json.dumps(told)], **pipes) as process:
        process.stdin.close()
        assert process.wait(PATIENCE) == 1
    assert not scratch.exists()


def test_a_run_that_ends_every_process_is_recorded_as_lost_and_the_others_are_made(
    undisturbed, tmp_path, monkeypatch
):
    order = undisturbed.order(tmp_path / "fatal")
    fatal, original = order.batch.first, supervising._lines

    def lines(order, begin):
        """As before, but that processes for the first run are killed when it has begun."""
        for kind, content in original(order, begin):
            if begin == fatal:
                raise supervising._LostError("the process ended by signal SIGSEGV", begun_record)
            yield kind, content

    maker = RunMaker(undisturbed.variation, undisturbed.plans, "drake", tmp_path)
    begun_record = maker.begun(undisturbed.variation.run(fatal))
    monkeypatch.setattr(supervising, "_lines", lines)
    assert make_batch(order)
    assert not make_batch(order)  # Its file is there.
    rows = CampaignFolder(Path(order.folder)).table([order.batch]).to_pylist()
    assert [row["arrived"] for row in rows] == [False, True]
    assert rows[0]["reason"] == "the process ended by signal SIGSEGV"
    expected = undisturbed.folder.table([order.batch]).to_pylist()
    assert {key: rows[1][key] for key in ("time", "steps", "funnel_margin")} == {
        key: expected[1][key] for key in ("time", "steps", "funnel_margin")
    }


def test_a_scenario_that_was_changed_meanwhile_is_not_run(undisturbed, tmp_path):
    order = undisturbed.order(tmp_path / "changed")
    changed = CampaignFolder(tmp_path / "changed").campaign
    changed.write_text(changed.read_text().replace("max: 0.1", "max: 0.2"))
    with pytest.raises(ProcessError, match="was changed while the campaign ran"):
        make_batch(order)


def test_a_log_that_cannot_be_written_ends_the_command_and_loses_no_run(undisturbed, tmp_path):
    order = undisturbed.order(tmp_path / "kept")
    folder = CampaignFolder(tmp_path / "kept")
    file = undisturbed.file.with_name("kept.campaign.yaml")
    file.write_text(FILE.replace("  vary:", "  keep: all\n  vary:"))
    folder.campaign.write_bytes(file.read_bytes())
    batch = next(Batching(Variation(load_campaign(file)), undisturbed.plans).batches())
    order = replace(order, campaign=str(file), batch=batch)
    (folder.path / "logs").write_text("no folder")
    with pytest.raises(ProcessError, match="logs"):
        make_batch(order)
    assert not folder.has(batch)
    (folder.path / "logs").unlink()
    assert make_batch(order)
    assert all(row["arrived"] for row in folder.table([batch]).to_pylist())
