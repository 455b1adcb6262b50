"""The benchmark of killed processes measures a run in which one rejoins."""

import pytest

from benchmarks.rejoining import killed, rejoining_tasks
from tests.support.sampled_team import sampled
from tests.support.small_loop import small_maps


@pytest.mark.slow
@pytest.mark.no_cover
def test_a_kill_is_measured_from_the_fault_to_the_time_when_the_team_goes_on():
    scenario, plan = sampled("base")
    rows = {row.figure: row.value for row in killed("apart/x", scenario, plan, small_maps(), 0, 1.2)}
    assert 0.1 < rows["rests_after"] < rows["goes_on_after"] < 2.0
    assert 1.0 < rows["way"] < 300.0
    assert rows["clearance_from_then_on"] <= rows["clearance_while_braking"]
    assert rows["clearance_from_then_on"] > 50.0
    assert rows["clearance_before"] > 50.0


def test_the_tasks_say_who_is_killed_and_when():
    names = [task.name for task in rejoining_tasks()]
    assert "apart/kills/base_supervisor_at_3_s" in names
    assert "apart/kills/three_robot_2_at_4_s" in names
