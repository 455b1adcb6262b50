"""The part of a large floor near a short route: planning there costs what the way costs, not the floor."""

from __future__ import annotations

from dataclasses import replace
from heapq import heappop, heappush
from math import hypot, sqrt

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon
from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.polygons import component_at, polygon_rings, squared_distance
from coop_drake.geometry.sweeps import following
from coop_drake.jit import compiled
from coop_drake.planning.questions import check_question, relaxed
from coop_drake.planning.sampling.collision import centres_inside
from coop_drake.planning.sampling.sampler import disc_question
from coop_drake.tree.arrays import FloatArray, IntArray

# A short route for a disc across a floor of any size, by A* on squares.
#
# Random trees need samples everywhere on a floor; the route needs a pass over its walls. It guides the
# search and proves nothing.

SQUARES_PER_RADIUS = 2.0
"""Squares in the disc's radius [-]."""

MOST_SQUARES = 3_000_000
"""Greatest number of squares, about: they take 32 bytes each."""

WIDE = 4.0
"""Where the disc has this many radii of space around its centre, more makes no difference [-]."""

NARROWNESS_PRICE = 2.0
"""A way where the disc touches the wall counts as longer by this fraction [-], and less with more space."""

TURN_PRICE = 2.0
"""A turn by an eighth costs as much as so many radii of way [-]: teams turn slowly."""


def disc_route(
    floor: Polygon | MultiPolygon, start: FloatArray, goal: FloatArray, radius: float
) -> FloatArray:
    """Find a short route for a disc, which prefers wide passages.

    A passage that is narrower than the disc by less than a square may be taken.

    Args:
        floor: Where the disc may be [m].
        start: Its first centre, shape (2,) [m].
        goal: Its last centre, shape (2,) [m].
        radius: Its radius, greater than zero [m].

    Returns:
        Corners of the route, shape (k, 2) [m]; no rows if none was found.
    """
    edges = np.concatenate([np.hstack((ring, following(ring))) for ring in polygon_rings(floor)])
    lower, upper = np.array(floor.bounds[:2]), np.array(floor.bounds[2:])
    side = max(radius / SQUARES_PER_RADIUS, sqrt(float(np.prod(upper - lower)) / MOST_SQUARES))
    columns, rows = (int(count) + 1 for count in (upper - lower) / side)
    squares = ((np.array([start, goal]) - lower) / side).astype(np.int64)
    if (squares < 0).any() or (squares >= (columns, rows)).any():
        return np.empty((0, 2))
    inside = centres_inside(edges, lower, side, rows, columns)
    space = _space(edges, lower, side, rows, columns, WIDE * radius)
    space[inside == 0] = 0.0
    first, last = (int(column * rows + row) for column, row in squares)
    visited = _shortest(
        space, rows, first, last, max(radius - 0.5 * side, 0.0), WIDE * radius, TURN_PRICE * radius / side
    )
    if not len(visited):
        return np.empty((0, 2))
    centres = lower + side * (np.column_stack((visited // rows, visited % rows)) + 0.5)
    points = np.concatenate((start[None], centres[1:-1], goal[None]))
    route: FloatArray = shapely.get_coordinates(LineString(points).simplify(0.5 * side))
    return route


@compiled
def _space(
    edges: FloatArray, corner: FloatArray, side: float, rows: int, columns: int, most: float
) -> FloatArray:
    """Distance of every square's middle from the nearest edge, at most ``most``, columns first, (S,) [m]."""
    space = np.full(rows * columns, most)
    for e in range(len(edges)):
        x0, y0, x1, y1 = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        west = max(0, int((min(x0, x1) - most - corner[0]) / side))
        east = min(columns, int((max(x0, x1) + most - corner[0]) / side) + 1)
        south = max(0, int((min(y0, y1) - most - corner[1]) / side))
        north = min(rows, int((max(y0, y1) + most - corner[1]) / side) + 1)
        for column in range(west, east):
            x = corner[0] + (column + 0.5) * side
            for row in range(south, north):
                y, square = corner[1] + (row + 0.5) * side, column * rows + row
                distance = squared_distance(x, y, x0, y0, x1, y1)
                if distance < space[square] * space[square]:
                    space[square] = sqrt(distance)
    return space


@compiled
def _shortest(
    space: FloatArray, rows: int, start: int, goal: int, least: float, wide: float, turn: float
) -> IntArray:
    """Squares of the cheapest way between two squares, by A*, both among them; none if there is no way.

    A turn is priced when a way is made longer; that the cheapest way to a square may turn sooner than another
    one is left out of account, so that ways with few turns are found among those of about the same length.

    Args:
        space: Distance of every square's middle from the walls, 0 outside the floor, shape (S,) [m].
        rows: Number of squares along y.
        start: Where the way begins.
        goal: Where it ends.
        least: Space that squares on the way must have [m]; start and goal need none.
        wide: Space above which squares cost the same [m].
        turn: Cost of a turn by an eighth, in sides of a square [-].
    """
    columns = len(space) // rows
    cost, before = np.full(len(space), np.inf), np.full(len(space), -1)
    cost[start] = 0.0
    waiting = [(0.0, start)]
    while len(waiting) > 0 and waiting[0][1] != goal:
        _, square = heappop(waiting)
        column, row = square // rows, square % rows
        dx, dy = 0, 0
        if square != start:
            dx, dy = column - before[square] // rows, row - before[square] % rows
        for i in range(max(column - 1, 0), min(column + 2, columns)):
            for j in range(max(row - 1, 0), min(row + 2, rows)):
                other = i * rows + j
                if space[other] < least and other != goal:
                    continue
                narrow = 1.0 - min(space[other], wide) / wide
                further = cost[square] + hypot(i - column, j - row) * (1.0 + NARROWNESS_PRICE * narrow)
                further += turn * (abs(i - column - dx) + abs(j - row - dy) if square != start else 0)
                if further < cost[other]:
                    cost[other], before[other] = further, square
                    left = hypot(i - goal // rows, j - goal % rows)
                    heappush(waiting, (further + left, other))
    if before[goal] < 0 and goal != start:
        return np.empty(0, np.int64)
    count, square = 1, goal
    while square != start:
        count, square = count + 1, before[square]
    way, square = np.empty(count, np.int64), goal
    for k in range(count - 1, -1, -1):
        way[k] = square
        square = before[square]
    return way


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
