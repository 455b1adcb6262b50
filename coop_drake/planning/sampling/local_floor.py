"""The part of a large floor near a short route: planning there costs what the way costs, not the floor."""

from __future__ import annotations

from dataclasses import replace

import shapely
from shapely import LineString, Point
from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.parts import component_at
from coop_drake.planning.questions.question_checks import check_question
from coop_drake.planning.questions.relaxation import relaxed
from coop_drake.planning.sampling.disc_route import disc_route
from coop_drake.planning.sampling.subsystems import disc_question
from coop_drake.tree.pose import FloatArray

MANY_CORNERS = 1_000
"""Floors with more corners are large [-]: below, looking for a route saves less than it takes."""

REACHES = 2.5
"""The local floor extends so many reaches of the team to each side of the route [-]: there the team may turn,
and use the next aisle."""

SMALLER = 0.5
"""A local floor with more than this fraction of the floor's corners is not used [-]."""


def local_question(problem: PlanningProblem) -> tuple[PlanningProblem, FloatArray] | None:
    """The question on the part of its floor near a route; None if the floor is small or there is no route.

    What is free there is free on the floor, because the part lies inside it. That no path exists there says
    nothing about the floor.

    Returns:
        The question, and the route, shape (k, 2) [m].

    Raises:
        PlanError: If the question has no meaning; names the entry and what is allowed.
    """
    corners = shapely.get_num_coordinates(problem.workspace)
    if corners <= MANY_CORNERS or problem.settings.strategy != "portfolio":
        return None
    check_question(problem)
    try:
        route = object_route(problem)
        if route is None:
            return None
        strip = LineString(route).buffer(REACHES * problem.tree.reach, join_style="mitre")
        near = component_at(problem.workspace.intersection(strip), Point(problem.start[:2]))
    except ShapelyError:
        return None
    if shapely.get_num_coordinates(near) > SMALLER * corners or not near.contains(
        Point(problem.goal_pose[:2])
    ):
        return None
    return replace(problem, workspace=near), route


def object_route(problem: PlanningProblem) -> FloatArray | None:
    """Route of a disc inside the object from start to goal, shape (k, 2) [m]; None if there is none."""
    team = disc_question(relaxed(problem, ())[0]).tree
    radius = team.components[0].bodies[0].shapes[0].radius
    if radius <= 0.0:
        return None
    route = disc_route(problem.workspace, problem.start[:2], problem.goal_pose[:2], radius)
    return route if len(route) > 1 else None
