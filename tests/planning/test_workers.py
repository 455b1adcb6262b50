"""Copies of a process: results in order, errors, ends; and the same answer with one, two or three workers."""

import json
import os
import time

import pytest

from benchmarks.planner.family import corridor_problem
from coop_drake.answers.plan_file import plan_document
from coop_drake.answers.problem import PlannerSettings
from coop_drake.errors import PlanError, ProcessError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.boxes.channel import CoveredPath
from coop_drake.planning.copies import Copies
from coop_drake.planning.planner import plan
from coop_drake.planning.search import search
from coop_drake.planning.search.search import find_path
from tests.planning.test_search import rod_problem
from tests.support.short_search import sample_little

WORKERS = (1, 2, 3)


def later(value, seconds):
    time.sleep(seconds)
    return value, os.getpid()


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_results_come_in_order_from_as_many_copies_as_wanted(count):
    works = [lambda k=k: later(k, 0.02 * (3 - k)) for k in range(3)]
    with Copies(works, count) as copies:
        values, processes = zip(*copies, strict=True)
    assert values == (0, 1, 2)
    assert len(set(processes)) == (3 if count else 1)
    assert (os.getpid() in processes) == (count == 0)


def test_an_error_is_raised_when_its_turn_comes_and_other_copies_end():
    def wrong():
        raise PlanError("nothing free")

    def endless():
        time.sleep(600.0)

    with Copies([lambda: 1, wrong, endless], 3) as copies:
        results = iter(copies)
        assert next(results) == 1
        children = [copy.pid for _, copy in copies._running.values()]
        with pytest.raises(PlanError, match="nothing free"):
            next(results)
    for child in children:
        with pytest.raises(ChildProcessError):
            os.waitpid(child, os.WNOHANG)


def test_a_copy_that_is_ended_is_told():
    with Copies([lambda: os._exit(3), lambda: 1], 2) as copies, pytest.raises(ProcessError):
        next(iter(copies))


def found_along(problem, workers):
    """The path and margin, or the reason why there is none, and the work."""
    answer, report = find_path(problem, workers=workers)
    if isinstance(answer, CoveredPath):
        return answer.path.tobytes(), answer.margin, report.slices
    return answer.proved, answer.reason, report.slices


def test_further_paths_are_the_same_with_any_number_of_workers():
    def planned(workers):
        result = plan(
            rod_problem(0.6), ScheduledGains(), gain_set_name="scheduled", workers=workers, effort=3.0
        )
        return json.dumps(plan_document(result.plan)), result.report.slices

    assert len({planned(workers) for workers in WORKERS}) == 1


def test_attempts_that_fail_at_first_are_the_same_with_any_number_of_workers():
    problem = corridor_problem(1.2, 1.1, robots=3)
    answers = {found_along(problem, workers) for workers in WORKERS}
    assert len(answers) == 1
    assert isinstance(answers.pop()[0], bytes)


@pytest.mark.no_cover
@pytest.mark.parametrize(("corridor", "proved"), [(0.197, True), (0.2, False)])
def test_narrow_passages_and_proofs_are_the_same_with_any_number_of_workers(corridor, proved, monkeypatch):
    monkeypatch.setattr(search, "FIRST_EXPLORATION", 8)
    sample_little(monkeypatch)
    problem = rod_problem(corridor, PlannerSettings(max_slices=20))
    answers = {found_along(problem, workers) for workers in WORKERS}
    assert [answer[0] for answer in answers] == [proved]
