"""The benchmark of processes runs a team both ways."""

import pytest

from benchmarks.apart import apart_tasks, costs


@pytest.mark.no_cover
def test_a_team_of_two_is_measured_both_ways():
    rows = {row.name.rsplit("/", 1)[1]: row for row in costs(2, 0.1)}
    assert {*rows} == {"times_real_time", "cpu", "cpu_each_robot_and_sample"}
    assert min(rows["times_real_time"].value, rows["cpu"].value) > 0.0


def test_the_tasks_name_their_teams():
    assert [task.name for task in apart_tasks()] == [f"apart/cost/{robots}_robots" for robots in (2, 4, 8)]
