"""The benchmark of drives without effort measures a run in which the others brake."""

import pytest

import benchmarks.limp
from benchmarks.limp import limp, limp_tasks
from tests.support.sampled_team import sampled
from tests.support.small_loop import small_maps


@pytest.mark.slow
@pytest.mark.no_cover
def test_a_team_whose_others_brake_moves_less_than_one_that_follows_the_plan(monkeypatch):
    monkeypatch.setattr(benchmarks.limp, "_AFTER", 0.4)
    scenario, plan = sampled("base")
    way = {}
    for others in ("brake", "follow"):
        rows = {
            row.figure: row.value for row in limp("apart/x", scenario, plan, small_maps(), 0, 1.0, others)
        }
        assert rows["moves_for"] == pytest.approx(0.4)
        assert rows["clearance"] > 0.0
        way[others] = rows["way"]
    assert 0.0 < way["brake"] < way["follow"]


def test_the_tasks_are_those_of_robots():
    names = [task.name for task in limp_tasks()]
    assert len(names) == 9
    assert "apart/limp/elbow_robot_0_at_2.5_s" in names
