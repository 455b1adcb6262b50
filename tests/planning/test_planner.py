"""The planner: answers, efforts, bytes that do not change, and a whole transport."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shapely import box

from coop_drake.answers import BeyondLimits, Found, Infeasible, SearchReport, Undecided
from coop_drake.answers.plan import Refusal, check_plan, plan_document
from coop_drake.errors import StallError
from coop_drake.laws import ScheduledGains
from coop_drake.planning import planner
from coop_drake.planning.channel import CoveredPath, NoChannel
from coop_drake.planning.duration import plan_time
from coop_drake.planning.planner import plan, quicker_plans
from coop_drake.planning.rescaling import Rescaling
from coop_drake.planning.search import find_path
from tests.planning.test_search import rod_problem
from tests.support.channels import bent_channel
from tests.support.point_mass import build_fields, carry_out

# The planner's three answers, with the search replaced by channels written by hand.

REPORT = SearchReport(10)


@pytest.fixture
def asked(monkeypatch):
    """Play a list of answers of the search; returns the function that sets them and the questions asked."""
    questions = []

    def play(*answers):
        left = list(answers)

        def find_path(problem, progress=None):
            questions.append(problem)
            return left.pop(0), REPORT

        monkeypatch.setattr(planner, "find_path", find_path)
        return questions

    return play


def blocked(channel):
    """The same channel with an aisle of a tenth of a millimetre as its last cell."""
    last = channel.boxes[-1]
    x0, _, x1, _ = last.polygon.bounds
    wall = box(x0, 6.2, x1, 6.4).difference(box(5.0, 6.1, 5.0001, 6.5))
    return replace(channel, boxes=(*channel.boxes[:-1], replace(last, polygon=last.polygon.difference(wall))))


def ask(problem):
    return planner.plan(problem, ScheduledGains(), gain_set_name="scheduled")


def test_a_question_that_is_changed_afterwards_is_another_question(asked):
    problem, _ = bent_channel(cells=3)
    questions = asked(NoChannel(True, "separated"), NoChannel(True, "separated"))
    ask(problem)
    problem.start[0] += 0.01
    ask(problem)
    assert questions[0] != questions[1]
    assert questions[1].start[0] == pytest.approx(questions[0].start[0] + 0.01)


def test_a_proof_is_infeasible_and_a_spent_budget_undecided(asked):
    problem, _ = bent_channel(cells=3)
    asked(NoChannel(True, "separated"))
    assert ask(problem) == Infeasible("separated", REPORT)
    asked(NoChannel(False, "budget spent"))
    assert ask(problem) == Undecided("budget spent", REPORT)


def test_a_channel_that_stalls_is_searched_again_at_half_the_margin(asked):
    problem, channel = bent_channel(cells=3)
    questions = asked(blocked(channel), channel)
    result = ask(problem)
    assert isinstance(result, Found)
    assert result.report.slices == 20
    assert [question.settings.margin for question in questions] == [0.1, channel.margin / 2]


def test_channels_that_all_stall_are_a_way_with_the_limit_named(asked):
    problem, channel = bent_channel(cells=3)
    questions = asked(*[blocked(channel)] * 3)
    result = ask(problem)
    assert isinstance(result, BeyondLimits)
    assert len(questions) == 3
    assert result.plan.refused_by[0] == Refusal(
        "planner.min_clearance", 2, pytest.approx(5e-5, rel=0.1), 1e-3, "m"
    )
    assert (
        "planner.min_clearance: in cell 2 the object's path or its target has a clearance of 0.0"
        in result.reason
    )


def test_a_stall_at_no_margin_is_not_asked_again(asked):
    problem, channel = bent_channel(cells=3)
    questions = asked(replace(blocked(channel), margin=0.0))
    assert isinstance(ask(problem), BeyondLimits)
    assert len(questions) == 1


# More effort gives plans that are no slower, the same effort the same plan, and no effort the first path.

REPEATED = 2.5
"""An effort that is no whole number: the last path has half of the usual work."""


@pytest.fixture(scope="module")
def problem():
    return rod_problem(0.6)


def effort_of(problem, effort=None, progress=None):
    result = plan(problem, ScheduledGains(), gain_set_name="scheduled", effort=effort, progress=progress)
    assert isinstance(result, Found)
    return result


def test_plans_are_no_slower_with_more_effort_and_repeat(problem):
    results = {effort: effort_of(problem, effort) for effort in (0.0, 1.0, REPEATED)}
    again = effort_of(replace(problem, settings=replace(problem.settings, effort=REPEATED)))
    assert json.dumps(plan_document(again.plan)) == json.dumps(plan_document(results[REPEATED].plan))
    assert plan_time(results[REPEATED].plan) <= plan_time(results[1.0].plan)
    for result in results.values():
        seconds, estimates = np.array(result.report.improvements).T
        assert (np.diff(seconds) > 0.0).all()
        assert (np.diff(estimates) < 0.0).all()
        assert estimates[-1] == pytest.approx(plan_time(result.plan))


@pytest.mark.parametrize("effort", [-0.1, float("nan"), float("inf")])
def test_efforts_without_meaning_are_refused(problem, effort):
    with pytest.raises(ValueError, match=r"allowed are numbers of 0 or more"):
        plan(problem, ScheduledGains(), gain_set_name="scheduled", effort=effort)


def test_only_quicker_plans_are_kept_and_shown():
    asked_for, told = [], []
    problem, _ = bent_channel(cells=3)
    made = effort_of(problem, 1.0).plan

    def lasting(seconds):
        first, *others = (replace(step, estimated_time=0.0) for step in made.transitions)
        return replace(made, transitions=(replace(first, estimated_time=seconds), *others))

    def another(number, share):
        asked_for.append((number, share))
        return CoveredPath(np.zeros((2, 3)), 0.0, bool, another) if number != 2 else None

    plans = iter([lasting(11.0), StallError("too narrow"), lasting(9.0)])

    def make(path):
        latest = next(plans)
        if isinstance(latest, Exception):
            raise latest
        return latest

    found = CoveredPath(np.zeros((2, 3)), 0.0, bool, another)
    quicker = quicker_plans(found, lasting(10.0), make, 4.5, lambda phase, fraction: told.append(phase))
    assert [plan_time(one) for one in quicker] == [9.0]
    assert asked_for == [(1, 1.0), (2, 1.0), (3, 1.0), (4, 0.5)]
    assert all("10.0 s so far" in phase for phase in told)


def test_a_team_twenty_times_as_large_has_further_paths_too(problem):
    large = Rescaling(problem, 0.05).question()
    found, _ = find_path(large)
    assert isinstance(found, CoveredPath)
    other = found.another(1, 1.0)
    assert other is not None
    assert np.allclose(other.path[0], large.start)
    assert np.allclose(other.path[-1, :2], large.goal_pose[:2])
    assert not np.array_equal(other.path, found.path)


# The same question has the same plan, byte for byte, whatever the hash seed and the number of threads.

_SCRIPT = """
import sys
from pathlib import Path
from coop_drake.laws import ScheduledGains
from coop_drake.answers import save_plan
from coop_drake.planning import planner
from tests.support.passages import FoldingArm
problem = FoldingArm().problem(0.6)
result = planner.plan(problem, ScheduledGains(), gain_set_name="scheduled")
save_plan(result.plan, Path(sys.argv[1]))
print(result.report.slices)
"""


def planned(directory: Path, hash_seed: str, threads: str) -> tuple[bytes, str]:
    """Plan in a process of its own; returns the plan file's bytes and what was told."""
    path = directory / f"plan_{hash_seed}_{threads}.json"
    names = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, **dict.fromkeys(names, threads)}
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(path)],
        env=environment,
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return path.read_bytes(), done.stdout


@pytest.mark.slow
def test_hash_seeds_and_threads_change_no_byte(tmp_path: Path) -> None:
    first, second = planned(tmp_path, "0", "1"), planned(tmp_path, "4242", "2")
    assert first == second


# From the question to the goal without Drake: searched, tidied, mapped and carried out by a point mass.


def test_the_transport_arrives_in_time_and_stays_in_its_cells(problem):
    made = effort_of(problem, 0.0).plan
    check_plan(made, "rod")
    transport = carry_out(made, build_fields(made))
    assert transport.stuck is None
    assert float(np.sum(transport.durations)) <= 60.0
    assert transport.least_energy_margin >= 0.0
    assert transport.least_cell_clearance > 0.0
    assert transport.least_funnel_gap > 0.0
    assert np.hypot(*(transport.position - problem.goal_pose[:2])) <= problem.position_tolerance
    assert abs(transport.axes[0] - made.goal_pose[2]) <= problem.angle_tolerance
