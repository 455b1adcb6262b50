"""The measuring of loops: as many evaluations on both sides, and a row for every mode."""

import pytest

from benchmarks.simulating import loop_cost, simulating_tasks
from tests.support.small_loop import small_maps, small_problem


def test_a_loop_is_measured_beside_the_plant_alone():
    cost = loop_cost((*small_problem("base"), small_maps()), 0.1)
    assert cost.evaluations >= 3 * 5  # three for each step of 0.02 s at most
    assert cost.bare_evaluations == pytest.approx(cost.evaluations, rel=0.25)
    assert cost.seconds > 0.0
    assert cost.bare_seconds > 0.0


def test_there_is_a_task_for_every_team_and_for_memory():
    names = [task.name for task in simulating_tasks()]
    assert names == [
        "simulating/base",
        *(f"simulating/ring_of_{n}" for n in (2, 3, 4, 8)),
        "simulating/memory",
    ]
    assert all(task.alone for task in simulating_tasks())
