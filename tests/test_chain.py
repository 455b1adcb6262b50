"""The names that coop_drake offers for Python: a whole transport by them, and what they refuse."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import coop_drake
from coop_drake.answers import SearchReport
from coop_drake.errors import PlanError, RefusalError, ScenarioError
from tests.support.certificates import bent_corridor
from tests.support.scenarios import ROOM, write_scenario


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    return coop_drake.load_scenario(write_scenario(tmp_path_factory.mktemp("room") / "room.scenario.yaml"))


@pytest.fixture(scope="module")
def answer(scenario):
    return coop_drake.plan(scenario)


def test_every_name_that_the_stub_lists_is_there():
    stub = Path(coop_drake.__file__).with_suffix(".pyi").read_text()
    (names,) = [node.value for node in ast.parse(stub).body if isinstance(node, ast.Assign)]
    listed = ast.literal_eval(names)
    assert listed == sorted(listed, key=lambda name: (not name[0].isupper(), name))
    assert set(listed) == set(coop_drake.__all__) == set(dir(coop_drake))
    assert all(hasattr(coop_drake, name) for name in listed)


def test_a_plan_is_verified_as_an_answer_as_a_plan_and_as_a_file(scenario, answer, tmp_path):
    assert answer.plan.gain_set == "scheduled"
    file = coop_drake.save_plan(answer.plan, tmp_path / "plan.json")
    for form in (answer, answer.plan, file, str(file)):
        assert coop_drake.verify(form, scenario).answer == "found"


def test_gains_are_chosen_by_name(scenario):
    assert coop_drake.plan(scenario, "table_2").plan.gain_set == "table_2"
    with pytest.raises(ScenarioError, match="'tabel_2' is not allowed; expected one of scheduled, table_2"):
        coop_drake.plan(scenario, "tabel_2")


def test_more_effort_gives_plans_that_are_no_slower(scenario, answer):
    better = coop_drake.plan(scenario, effort=3.0)
    assert better.report.improvements[-1][1] <= answer.report.improvements[-1][1]


def test_a_plan_for_another_question_is_refused(answer, tmp_path):
    start = {"object": {"x": 2.4, "y": 2.0, "theta": 0.0}, "joints": ROOM["start"]["joints"]}
    other = coop_drake.load_scenario(write_scenario(tmp_path / "other.scenario.yaml", start=start))
    with pytest.raises(RefusalError):
        coop_drake.verify(answer, other)


def test_an_infeasible_problem_is_planned_verified_without_a_scenario():
    problem = bent_corridor(0.45)
    no = coop_drake.plan(problem)
    assert isinstance(no, coop_drake.Infeasible)
    assert (
        coop_drake.verify(no, problem).answer == coop_drake.verify(no.proof, problem).answer == "infeasible"
    )


def test_an_undecided_answer_proves_nothing(scenario):
    undecided = coop_drake.Undecided("the budget ended", SearchReport(0))
    with pytest.raises(PlanError, match="an undecided answer proves nothing"):
        coop_drake.verify(undecided, scenario)


def test_a_question_and_its_plan_are_shown(scenario, answer):
    figures = [coop_drake.show(scenario), coop_drake.show(scenario, answer.plan, "A plan.")]
    assert all(isinstance(figure, Figure) for figure in figures)
    assert len(figures[1].axes[0].patches) > len(figures[0].axes[0].patches)
