"""Questions of growing size are what they say, possible to start, and the same every time."""

import pickle

import numpy as np
import pytest

from benchmarks.planner.cases import CASES
from benchmarks.planner.family import corridor_problem, crowd_problem, shelf_floor, shelf_problem
from coop_drake.planning.sampling.collision import grid_for_team, is_free
from coop_drake.tree.team_arrays import team_arrays

MAKERS = {
    "corridor": lambda: corridor_problem(0.9),
    "four": lambda: corridor_problem(1.3, 1.5, robots=4),
    "three joints": lambda: corridor_problem(joints_per_arm=3),
    "crowd": lambda: crowd_problem(6),
    "shelves": lambda: shelf_problem(500),
}


def starts_freely(problem):
    team = team_arrays(problem.tree)
    return is_free(team, grid_for_team(problem.workspace, team), problem.start.astype(float), 0.0)


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_questions_can_be_started_and_are_the_same_every_time(make):
    problem, again = make(), make()
    assert starts_freely(problem)
    assert problem.workspace.wkb == again.workspace.wkb
    assert pickle.dumps(team_arrays(problem.tree)) == pickle.dumps(team_arrays(again.tree))


@pytest.mark.parametrize("robots", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("joints", [1, 2, 3])
def test_teams_have_as_many_robots_and_joints_as_asked(robots, joints):
    problem = crowd_problem(robots) if joints == 1 else corridor_problem(1.3, 1.5, min(robots, 4), joints)
    tree = problem.tree
    assert [joint.index for joint in tree.joints] == list(range(len(tree.joints)))
    assert len(tree.joints) == joints * len({joint.robot for joint in tree.joints})
    assert len(problem.start) == 3 + len(tree.joints)


@pytest.mark.parametrize("vertices", [50, 500, 5_000])
def test_warehouses_have_about_as_many_vertices_as_asked(vertices):
    floor = shelf_floor(vertices)
    made = sum(len(ring.coords) - 1 for ring in (floor.exterior, *floor.interiors))
    assert floor.is_valid
    assert abs(made - vertices) <= 4


def test_the_family_holds_the_shipped_cases():
    base = next(case for case in CASES if case.name == "base").problem()
    mine = corridor_problem()
    assert mine.workspace.equals(base.workspace)
    assert np.array_equal(mine.start, base.start)
    assert [(j.lower, j.upper) for j in mine.tree.joints] == [(j.lower, j.upper) for j in base.tree.joints]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_scenario_file_can_be_read(case):
    assert starts_freely(case.problem())
