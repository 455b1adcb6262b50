"""What is measured and how: rows and their file, work in processes of its own, tasks, shapes, departures."""

import io
import json
import logging
import math
import threading
import time

import numpy as np
import pytest
from rich.console import Console
from shapely import Point, Polygon, box
from typer.testing import CliRunner

from benchmarks import app as benchmark
from benchmarks.departures import CASES, OBSERVED, PREDICTED, deployment_of
from benchmarks.domains import Domain, hall_with_pillars, standard_domains, wavy_room
from benchmarks.isolated import WorkerError, in_own_process
from benchmarks.map_rows import RESIDUAL, cost_rows, map_rows
from benchmarks.mapping import PILLARS, VERTICES
from benchmarks.planner.head_to_head import Effort
from benchmarks.rows import Ledger, LedgerError, Row
from benchmarks.table import TOPICS, show
from benchmarks.tasks import Task, chosen, worked
from coop_drake.scenario import Control, Deployment

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


def test_tables_show_topics_with_items_and_figures():
    console = Console(width=120, record=True, file=io.StringIO())
    show([BASE, GROWN, Row("planner/base/answer", 1.0, "found")], console)
    shown = console.export_text()
    for text in ("planner/growth/robots", "base", "0.5 (x2)", "found", "200", "beside OMPL, 0.25 s"):
        assert text in shown


def _busy():
    while True:
        time.process_time()


def _chatty():
    print("chatter")
    return math.hypot(3.0, 4.0)


def test_a_result_comes_back_with_the_cost_of_the_work_and_not_of_whoever_asked():
    held = np.ones(40_000_000)
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


def test_tasks_are_chosen_by_topic_and_by_parts_of_their_names():
    tasks = [Task(name, list) for name in ("planner/base", "planner/growth/robots/4", "mapping/base")]
    assert chosen(tasks, [], []) == tasks
    assert chosen(tasks, ["planner"], []) == chosen(tasks, ["planner"], ["robots", "base"]) == tasks[:2]
    assert chosen(tasks, [], ["base"]) == [tasks[0], tasks[2]]
    assert chosen(tasks, ["planner"], ["plan"]) == []


def test_every_topic_of_the_help_has_tasks_of_their_own_names():
    names = [task.name for task in benchmark._tasks(Effort())]
    assert len(set(names)) == len(names)
    assert {name.partition("/")[0] for name in names} == {*TOPICS}


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


def test_a_failed_task_is_told_and_does_not_end_the_others():
    tasks = [Task("a", failing(WorkerError("no luck"))), Task("b", lambda rows: [ROW])]
    outcomes = {done.task.name: (done.rows, done.error) for done in worked(tasks, list, jobs=1)}
    assert str(outcomes["a"][1]) == "no luck"
    assert outcomes["b"] == ([ROW], None)


def test_whoever_stops_listening_stops_the_work():
    started = threading.Event()

    def quick(rows):
        started.wait(10)
        return []

    def endless(rows):
        started.set()
        return [Row("a/b/c", in_own_process(_busy, limit=100).cpu_seconds, "s")]

    listening = worked([Task("quick", quick), Task("endless", endless)], list, jobs=2)
    assert next(listening).task.name == "quick"
    listening.close()


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run the command with other tasks; returns its result and the rows that it wrote, None for no file."""

    def run(tasks, *arguments):
        monkeypatch.setattr(benchmark, "_tasks", lambda effort: tasks)
        monkeypatch.setattr(benchmark, "compile_kernels", int)
        out = tmp_path / "deep" / "bench.json"
        result = CliRunner().invoke(benchmark.app, [*arguments, "--out", str(out)])
        return result, json.loads(out.read_text()) if out.exists() else None

    return run


ONE = [Task("topic/item", lambda rows: [ROW])]


@pytest.mark.parametrize("missing", [True, False])
def test_rows_are_written_and_shown_and_without_ompl_its_own_are_left_out(run, monkeypatch, missing):
    monkeypatch.setattr(benchmark, "has_ompl", lambda: not missing)
    level = logging.getLogger("drake").level
    result, rows = run(ONE, "all")
    assert (result.exit_code, rows) == (0, [ROW.as_dict()])
    assert logging.getLogger("drake").level == level
    assert "figure" in result.output
    assert "Tasks: 1, about" in result.output
    assert ("OMPL is not installed" in result.output) == missing


def test_a_name_that_nothing_has_is_bad_use(run):
    result, rows = run(ONE, "subject")
    assert (result.exit_code, rows) == (2, None)
    assert "nothing is called subject" in result.output


def test_a_list_measures_nothing_and_names_every_part(run):
    names = ("planner/base", "planner/growth/width/1", "mapping/domains/maze")
    result, rows = run([Task(name, failing(AssertionError())) for name in names], "--list")
    assert (result.exit_code, rows) == (0, None)
    shown = [[cell.strip() for cell in line.split("│")[1:-1]] for line in result.output.splitlines()]
    told = {row[0]: (row[1], row[3]) for row in shown if len(row) == 4 and row[0]}
    assert told == {"planner": ("2", "base, growth"), "mapping": ("1", "domains")}


def test_ctrl_c_keeps_what_was_measured(run):
    result, rows = run([*ONE, Task("last", failing(KeyboardInterrupt()), alone=True)])
    assert (result.exit_code, rows) == (130, [ROW.as_dict()])


@pytest.mark.parametrize("domain", standard_domains().values(), ids=standard_domains())
def test_shapes_are_valid_and_hold_their_goals(domain):
    assert domain.cell.is_valid
    assert domain.cell.covers(domain.goal)


def test_rooms_have_as_many_corners_and_halls_as_many_pillars_as_asked():
    assert [wavy_room(count).vertices for count in VERTICES] == list(VERTICES)
    for count in PILLARS:
        hall = hall_with_pillars(count)
        assert (len(hall.cell.interiors), hall.vertices) == (count, 4 + 4 * count)
        assert hall.cell.contains(hall.goal)


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


def test_cases_are_deployments_each_of_its_own_and_every_departure_has_one():
    """Whatever differs from the ideal team somewhere in a section does so in a case."""
    data = [data for case in CASES.values() for data in (case.mild, case.harsh) if data is not None]
    assert len({repr(deployment_of(one)) for one in data}) == len(data)
    assert deployment_of(CASES["nothing"].mild) == Deployment()
    assert deployment_of(CASES["sampling"].mild) == Deployment(control_rate=200.0)
    for one in (*OBSERVED.values(), *PREDICTED.values()):
        assert deployment_of(one) != Deployment()
    for part in ("measurements", "actuators", "messages", "floor", "robots", "pushes"):
        assert any(getattr(deployment_of(one), part) != getattr(Deployment(), part) for one in data)
    assert Control() == Control(predictor=False, observer=False)
