"""What is measured and how: rows and their file, work in processes of its own, tasks, shapes, departures."""

import json
import math
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from shapely import Point, Polygon, box
from typer.testing import CliRunner

from benchmarks import app as benchmark
from benchmarks.domains import Domain
from benchmarks.isolated import WorkerError, in_own_process
from benchmarks.map_rows import RESIDUAL, cost_rows, map_rows
from benchmarks.rows import Ledger, LedgerError, Row
from benchmarks.smooth import shortest_way, squeezing_of
from benchmarks.tasks import Task, worked

BASE = Row("planner/base/cpu_seconds", 0.5, "s", "OMPL", 0.25)
GROWN = Row("planner/growth/robots/4/peak_memory", 200.0, "MB")
ROW = Row("topic/item/figure", 1.0, "s")


def test_the_file_is_a_list_of_rows_that_every_run_adds_to(tmp_path):
    assert (GROWN.topic, GROWN.item, GROWN.figure) == ("planner/growth/robots", "4", "peak_memory")
    assert (BASE.ratio, GROWN.ratio) == (2.0, None)
    path = tmp_path / "bench.json"
    Ledger(path, fresh=True).add([BASE, GROWN])
    later = Ledger(path, fresh=False)
    assert later.rows == (BASE, GROWN)
    later.add([Row("planner/base/cpu_seconds", 0.1, "s", "OMPL", 0.25)])
    entries = json.loads(path.read_text())
    assert [(entry["name"], entry["value"]) for entry in entries] == [(BASE.name, 0.1), (GROWN.name, 200.0)]
    assert (entries[0]["peer"], entries[0]["peer_value"], entries[0]["ratio"]) == ("OMPL", 0.25, 0.4)
    assert Ledger(path, fresh=True).rows == ()


@pytest.mark.parametrize("content", ["{", "{}", '[{"name": "a"}]', "[1]"])
def test_a_file_of_something_else_is_refused_and_left_alone(tmp_path, content):
    path = tmp_path / "bench.json"
    path.write_text(content)
    with pytest.raises(LedgerError, match=r"bench\.json"):
        Ledger(path, fresh=False)
    assert path.read_text() == content


def _busy():
    while True:
        time.process_time()


def _chatty():
    print("chatter")
    return math.hypot(3.0, 4.0)


def test_a_result_comes_back_with_the_cost_of_the_work_and_not_of_whoever_asked():
    held = np.ones(60_000_000)
    done = in_own_process(_chatty, limit=10)
    assert (done.value, done.cpu_seconds < 1.0) == (5.0, True)
    assert 5.0 < done.peak_mb < 1e-6 * held.nbytes


@pytest.mark.slow
def test_work_that_takes_too_long_is_stopped():
    done = in_own_process(_busy, limit=1)
    assert done.value is None
    assert done.cpu_seconds >= 1.0


def test_a_failure_says_what_failed():
    with pytest.raises(WorkerError, match=r"math\.sqrt failed(.|\n)*domain"):
        in_own_process(math.sqrt, -1.0, limit=10)


def test_tasks_that_need_the_machine_for_themselves_come_last_and_see_the_rows_of_the_others():
    seen, known, names = [], [], []
    both = threading.Barrier(2, timeout=300)

    def shared(rows):
        both.wait()
        return [ROW]

    def alone(rows):
        seen.append(tuple(rows))
        return []

    tasks = [Task("a", alone, alone=True), Task("b", shared), Task("c", shared)]
    for done in worked(tasks, lambda: known, jobs=2):
        names.append(done.task.name)
        known.extend(done.rows)
    assert names[-1] == "a"
    assert seen == [(ROW, ROW)]


def failing(error):
    def work(rows):
        raise error

    return work


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run the command with other tasks; returns its result and the rows that it wrote, None for no file."""

    def run(tasks, *arguments):
        monkeypatch.setattr(benchmark, "_tasks", lambda effort, runs: tasks)
        monkeypatch.setattr(benchmark, "compile_kernels", int)
        out = tmp_path / "deep" / "bench.json"
        result = CliRunner().invoke(benchmark.app, [*arguments, "--out", str(out)])
        return result, json.loads(out.read_text()) if out.exists() else None

    return run


ONE = [Task("topic/item", lambda rows: [ROW])]


def test_ctrl_c_keeps_what_was_measured(run):
    result, rows = run([*ONE, Task("last", failing(KeyboardInterrupt()), alone=True)])
    assert (result.exit_code, rows) == (130, [ROW.as_dict()])


def test_a_map_is_measured_beside_its_peers_and_a_shape_that_is_refused_is_a_row_too():
    square = Domain(box(0, 0, 1, 1), Point(0.5, 0.4))
    rows = {row.figure: row for row in map_rows("mapping/domains/square", square, 2e-3)}
    assert rows["answer"].unit == "mapped"
    assert 0.0 < rows["residual"].value <= RESIDUAL
    assert rows["residual"].peer_value == 2e-3
    assert rows["cpu_seconds"].peer == f"dense solve, {rows['unknowns'].value} unknowns"
    assert all(rows[figure].ratio > 0.0 for figure in ("cpu_seconds", "one_point", "per_point_of_1000"))
    needle = Domain(Polygon([(0, 0), (3, 0), (0, 0.01)]), Point(0.1, 0.003))
    refused = cost_rows("mapping/growth/needle", needle)
    assert [(row.figure, row.unit) for row in refused] == [("answer", "refused"), ("vertices", "-")]


def test_squeezing_is_what_is_left_of_a_force_without_the_share_of_their_sum():
    forces = [[[2.0, 4.0, 9.0], [6.0, 12.0, 9.0]], [[5.0, 1.0, 0.0], [3.0, 7.0, 0.0]]]
    log = SimpleNamespace(measured_wrenches=np.array(forces))
    assert squeezing_of(log, np.array([0.25, 0.75])) == pytest.approx(math.hypot(3.0, 1.0))


def test_the_shortest_way_through_two_regions_bends_at_the_corner_between_them():
    ends = np.array([[0.5, 0.5], [2.5, 2.5]])
    shortest = shortest_way([box(0, 0, 1, 3), box(0, 2, 3, 3)], ends)
    assert shortest == pytest.approx(math.hypot(0.5, 1.5) + math.hypot(1.5, 0.5))
