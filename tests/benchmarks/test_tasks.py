"""Which tasks run, in which order, and what becomes of failures and of Ctrl-C."""

import json
import logging
import threading

import pytest
from typer.testing import CliRunner

from benchmarks import app as benchmark
from benchmarks.isolated import WorkerError, in_own_process
from benchmarks.rows import Row
from benchmarks.tasks import Task, chosen, worked

ROW = Row("topic/item/figure", 1.0, "s")


def test_tasks_are_chosen_by_topic_and_by_parts_of_their_names():
    def task(name):
        return Task(name, lambda rows: [])

    tasks = [task("planner/base"), task("planner/growth/robots/4"), task("mapping/base")]
    assert chosen(tasks, [], []) == tasks
    assert chosen(tasks, ["planner"], []) == tasks[:2]
    assert chosen(tasks, [], ["base"]) == [tasks[0], tasks[2]]
    assert chosen(tasks, ["planner"], ["robots", "base"]) == tasks[:2]
    assert chosen(tasks, ["planner"], ["plan"]) == []


def test_tasks_that_need_the_machine_for_themselves_come_last_and_see_the_rows_of_the_others():
    seen, known = [], []
    both = threading.Barrier(2, timeout=300)

    def shared(rows):
        both.wait()
        return [ROW]

    def alone(rows):
        seen.append(tuple(rows))
        return []

    tasks = [Task("a", alone, alone=True), Task("b", shared), Task("c", shared)]
    names = []
    for done in worked(tasks, lambda: known, jobs=2):
        names.append(done.task.name)
        known.extend(done.rows)
    assert names[-1] == "a"
    assert seen == [(ROW, ROW)]


def test_a_failed_task_is_told_and_does_not_end_the_others():
    def failing(rows):
        raise WorkerError("no luck")

    outcomes = {
        done.task.name: (done.rows, done.error)
        for done in worked([Task("a", failing), Task("b", lambda rows: [ROW])], list, jobs=1)
    }
    assert str(outcomes["a"][1]) == "no luck"
    assert outcomes["b"] == ([ROW], None)


def test_whoever_stops_listening_stops_the_work():
    started = threading.Event()

    def quick(rows):
        started.wait(10)
        return []

    def endless(rows):
        started.set()
        return [Row("a/b/c", in_own_process(_forever, limit=100).cpu_seconds, "s")]

    listening = worked([Task("quick", quick), Task("endless", endless)], list, jobs=2)
    assert next(listening).task.name == "quick"
    listening.close()


def _forever():
    while True:
        pass


def run(monkeypatch, tasks, *arguments):
    monkeypatch.setattr(benchmark, "_tasks", lambda effort: tasks)
    monkeypatch.setattr(benchmark, "compile_kernels", int)
    return CliRunner().invoke(benchmark.app, arguments)


def test_rows_are_written_and_shown(monkeypatch, tmp_path):
    out = tmp_path / "deep" / "bench.json"
    level = logging.getLogger("drake").level
    result = run(monkeypatch, [Task("topic/item", lambda rows: [ROW])], "--out", str(out))
    assert result.exit_code == 0
    assert logging.getLogger("drake").level == level
    assert json.loads(out.read_text()) == [ROW.as_dict()]
    assert "figure" in result.output


def test_a_name_that_nothing_has_is_bad_use(monkeypatch, tmp_path):
    out = tmp_path / "bench.json"
    result = run(monkeypatch, [Task("topic/item", lambda rows: [ROW])], "subject", "--out", str(out))
    assert result.exit_code == 2
    assert "nothing is called subject" in result.output
    assert not out.exists()


def test_a_list_measures_nothing_and_names_every_part(monkeypatch, tmp_path):
    def measured(rows):
        raise AssertionError

    names = ("planner/base", "planner/growth/width/1", "mapping/domains/maze")
    out = tmp_path / "bench.json"
    result = run(monkeypatch, [Task(name, measured) for name in names], "--list", "--out", str(out))
    assert result.exit_code == 0
    assert not out.exists()
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in result.output.splitlines()]
    told = {row[0]: (row[1], row[3]) for row in rows if len(row) == 4 and row[0]}
    assert told == {"planner": ("2", "base, growth"), "mapping": ("1", "domains")}


def test_all_is_everything_and_says_so_before_it_begins(monkeypatch, tmp_path):
    out = tmp_path / "bench.json"
    result = run(monkeypatch, [Task("topic/item", lambda rows: [ROW])], "all", "--out", str(out))
    assert result.exit_code == 0
    assert "Tasks: 1, about" in result.output
    assert json.loads(out.read_text()) == [ROW.as_dict()]


def test_ctrl_c_keeps_what_was_measured(monkeypatch, tmp_path):
    def interrupted(rows):
        raise KeyboardInterrupt

    out = tmp_path / "bench.json"
    tasks = [Task("topic/item", lambda rows: [ROW]), Task("last", interrupted, alone=True)]
    result = run(monkeypatch, tasks, "--out", str(out))
    assert result.exit_code == 130
    assert json.loads(out.read_text()) == [ROW.as_dict()]


@pytest.mark.parametrize("missing", [True, False])
def test_without_ompl_its_rows_are_left_out_with_one_line(monkeypatch, tmp_path, missing):
    monkeypatch.setattr(benchmark, "has_ompl", lambda: not missing)
    tasks = [Task("topic/item", lambda rows: [ROW])]
    result = run(monkeypatch, tasks, "--out", str(tmp_path / "bench.json"))
    assert ("OMPL is not installed" in result.output) == missing
