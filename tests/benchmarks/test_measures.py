"""The planner and its variants answer alike; an answer that does not come is none."""

import pytest

from benchmarks.planner import growth
from benchmarks.planner.ablation import VARIANTS, answer
from benchmarks.planner.family import first_question
from benchmarks.planner.ours import plan_repeatedly
from benchmarks.planner.stages import STAGES, without_stage

pytestmark = pytest.mark.slow

EASY = first_question()


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_variant_answers_an_easy_question(variant):
    answered = answer(EASY, variant)
    assert answered.answer == "found"
    assert answered.slices > 0


@pytest.mark.parametrize("variant", STAGES)
def test_a_plan_is_found_without_any_one_stage(variant):
    replaced = [(part.module, part.name, getattr(part.module, part.name)) for part in STAGES[variant]]
    planned = without_stage(EASY, variant)
    assert planned.answer == "found"
    assert planned.transport_seconds > 0.0
    assert all(getattr(module, name) is value for module, name, value in replaced)


def test_out_of_time_is_no_answer(monkeypatch):
    monkeypatch.setattr(growth, "plan_once_warm", _think_forever)
    rows = growth.growth_rows("planner/growth/none/1", EASY, limit=1)
    assert [row.figure for row in rows] == ["answer", "peak_memory"]
    assert (rows[0].value, rows[0].unit) == (0.0, "none within 1 CPU s")


def _think_forever(problem):
    while True:
        pass


def test_the_same_question_has_the_same_answer_and_is_not_asked_again_without_patience():
    first, second = plan_repeatedly(EASY, 2, patience=100.0)
    assert (first.answer, first.slices, first.cells) == (second.answer, second.slices, second.cells)
    assert len(plan_repeatedly(EASY, 5, patience=0.0)) == 1
