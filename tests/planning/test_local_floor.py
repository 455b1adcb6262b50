"""On large floors plans are looked for near a short route; they answer the question on the whole floor."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import LineString, Point, Polygon, box

from benchmarks.planner.family import corridor_problem, shelf_problem
from coop_drake.answers import Found
from coop_drake.answers.digest import problem_digest
from coop_drake.errors import PlanError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan
from coop_drake.planning.sampling.routes import MANY_CORNERS, disc_route, local_question
from coop_drake.verification import verify_plan

BEND = Polygon([(0, 0), (8, 0), (8, 1), (1, 1), (1, 7), (0, 7)])
"""Two aisles of 1 m that meet at a right angle."""


@pytest.mark.parametrize("radius", [0.1, 0.3, 0.45])
def test_a_route_keeps_the_disc_inside(radius: float) -> None:
    start, goal = np.array([7.5, 0.5]), np.array([0.5, 6.5])
    route = disc_route(BEND, start, goal, radius)
    assert (route[0] == start).all()
    assert (route[-1] == goal).all()
    line = LineString(route)
    assert BEND.contains(line)
    assert BEND.boundary.distance(line) > 0.7 * radius  # the disc's radius, but for half a square
    assert line.length < 14.0


def test_there_is_no_route_through_a_gap_that_is_too_narrow_or_from_outside() -> None:
    floor = Polygon(box(0, 0, 6, 2).exterior, [box(2.8, 0.1, 3.2, 1.8).exterior])
    assert len(disc_route(floor, np.array([1.0, 1.0]), np.array([5.0, 1.0]), 0.15)) == 0
    assert len(disc_route(floor, np.array([1.0, 1.0]), np.array([5.0, 1.0]), 0.08)) > 1
    assert len(disc_route(floor, np.array([9.0, 1.0]), np.array([5.0, 1.0]), 0.08)) == 0


def test_a_route_prefers_the_wide_passage_and_few_turns() -> None:
    floor = Polygon(box(0, 0, 9, 6).exterior, [box(4, 0.5, 5, 3.5).exterior])
    route = disc_route(floor, np.array([1.0, 2.2]), np.array([8.0, 2.2]), 0.2)
    assert LineString(route).intersects(box(4, 3.5, 5, 6))
    rows = shelf_problem(200)
    across = disc_route(rows.workspace, rows.start[:2], rows.goal_pose[:2], 0.2)
    assert len(across) <= 8


def test_a_plan_near_a_route_answers_the_question_on_the_whole_floor() -> None:
    far = shelf_problem(MANY_CORNERS + 200)
    question = replace(far, goal_pose=far.start[:3] + np.array([9.0, 0.0, 0.0]))  # three aisles further
    near = local_question(question)
    assert near is not None
    local, route = near
    assert local.workspace.contains(LineString(route))
    assert question.workspace.buffer(1e-9).contains(local.workspace)
    assert shapely.get_num_coordinates(local.workspace) < MANY_CORNERS / 2
    assert all(local.workspace.contains(Point(p[:2])) for p in (question.start, question.goal_pose))
    gains = ScheduledGains()
    result = plan(question, gains, gain_set_name="scheduled")
    assert isinstance(result, Found)
    verify_plan(result.plan, question, {"scheduled": gains})  # raises an error where it refuses
    assert result.plan.problem == problem_digest(question) != problem_digest(local)


def test_small_floors_and_floors_without_a_route_are_searched_whole() -> None:
    assert local_question(corridor_problem()) is None
    question = shelf_problem(MANY_CORNERS + 200)
    x_min, _, x_max, y_max = question.workspace.bounds
    wall = box(x_min - 1.0, 0.5 * y_max, x_max + 1.0, 0.5 * y_max + 0.2)
    parted = question.workspace.difference(wall)
    lower = max(parted.geoms, key=lambda part: -part.bounds[1])
    assert local_question(replace(question, workspace=Polygon(lower.exterior, lower.interiors))) is None


def test_a_large_question_without_meaning_is_refused() -> None:
    question = shelf_problem(MANY_CORNERS + 200)
    with pytest.raises(PlanError, match="goal_pose"):
        local_question(replace(question, goal_pose=np.array([np.nan, 0.0, 0.0])))
