"""A plan holds: cells are free, each leads to the next, from one with the start into the goal."""

from itertools import pairwise
from math import isqrt
from typing import Any

from coop_drake.checking import plane
from coop_drake.checking.plane import ONE, Interval, Point, demand, hull, numbers, points
from coop_drake.checking.regions import Region, read_region
from coop_drake.checking.team import Question, free, holds, intervals, relative, swept, unwrapped

ROUNDING = 10**9
"""Stated lengths may be off by one part in this; goal intervals are at least 1 m or rad over it [-]."""


def check_plan(question: Question, answer: Any, progress: plane.Progress) -> list[tuple[str, int]]:
    """Check a plan; returns the statements that hold and how often each was checked."""
    cells, transitions, entry = answer["cells"], answer["transitions"], question.start
    boxes = [intervals(cell["lower"], cell["upper"], question.axes, 1) for cell in cells]
    regions, count = [read_region(cell["tidied"]) for cell in cells], len(cells)
    demand(0 < count == len(transitions), "transitions", "are not as many as the cells")
    demand(holds(boxes[0], question.start_box), "cells[0]", "does not hold the start's angles")
    (room,) = numbers([transitions[-1]["inradius"]], 1)
    near = numbers(transitions[-1]["goal_lower"], question.axes)
    boxes.append(list(question.goal_box))
    for axis in question.circles:
        boxes[-1][axis] = unwrapped(boxes[-1][axis], (near[axis], near[axis]), outwards=-1)
    for k, value in enumerate(transitions):
        demand(holds(question.limits, boxes[k][1:]), f"cells[{k}]", "leaves the limits of a joint")
        entry = _leads_on(value, f"transitions[{k}]", entry, boxes[k : k + 2], regions[k : k + 2])
        _check_free(question, boxes[k], regions[k], f"cells[{k}]")
        progress("checking cells", (k + 1) / count)
    (x, y), (p, q), left = entry, question.goal, question.room - room
    reached = left >= 0 and (x - p) ** 2 + (y - q) ** 2 <= left**2
    demand(reached, "transitions[-1]", "does not end within the tolerance of the goal's position")
    return [
        ("joint intervals lie within the joints' limits", count * (question.axes - 1)),
        ("each transition ends inside its cell and the next, in intervals of both", 2 * count - 1),
        ("a path to each target has the stated length and distance from the cell's boundary", count),
        ("the start lies in the first cell, the end of the last transition in the goal", 2),
        ("no piece meets a wall at any configuration of any cell", count * len(question.pieces)),
        ("no two pieces of a pair meet at any configuration of any cell", count * len(question.pairs)),
    ]


def _leads_on(value: Any, where: str, entry: Point, boxes: list[plane.Box], regions: list[Region]) -> Point:
    """Check that a transition leads from its entry to a target in its cell and the next; returns it."""
    goals = intervals(value["goal_lower"], value["goal_upper"], len(boxes[0]), ONE // ROUNDING)
    demand(all(holds(box, goals) for box in boxes), f"{where}.goal_lower", "leaves a cell or the tolerance")
    radius, neck, stated = numbers([value["inradius"], value["neck"], value["length"]], 3)
    (target,), path = points([value["target"]]), points(value["path"])
    joined = len(path) > 1 and path[0] == entry and path[-1] == target
    demand(joined, f"{where}.path", "does not lead from the entry to the target")
    room, clear = (distance - distance // ROUNDING - 1 for distance in (radius, neck))
    inside = room >= 0 and all(region.side([target], room) > 0 for region in regions)
    demand(inside, f"{where}.inradius", "is not positive, or more than the target's distance from a boundary")
    inside = clear >= 0 and all(regions[0].side(hull(leg), clear) > 0 for leg in pairwise(path))
    demand(inside, f"{where}.neck", "is not positive, or more than the path's distance from the boundary")
    off = stated - sum(isqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2) for a, b in pairwise(path))
    demand(abs(off) <= (stated + ONE) // ROUNDING, f"{where}.length", "is not that of the path")
    return target


def _check_free(question: Question, box: list[Interval], region: Region, where: str) -> None:
    """Check that no piece meets a wall, and no two pieces of a pair each other, anywhere in a cell.

    Walls further from the cell than a piece reaches are left aside.

    An enclosure F of a piece meets a wall at positions in the Minkowski sum of the wall and -F. A piece that
    meets no wall lies inside the floor if one of its points does. As it moves without meeting a wall, that
    needs to be tested at one configuration for each ring of the cell: each part of it has a ring.
    """

    def clear(wall: tuple[Point, Point], moved: list[Point], gap: int) -> bool:
        return region.side(plane.difference(wall, moved), gap) < 0

    for body, chain, corners, radius in question.pieces:
        moved, gap = swept(corners, radius, chain, box)
        zone = [end + off for end, off in zip(region.box, plane.box_of(moved), strict=True)]
        walls = [question.floor.edges[k] for k in question.floor.near(zone, gap)]
        apart = free(corners, radius, chain, box, walls, clear)
        demand(apart, where, f"{body} may touch a wall")
        ((x, y),), error = swept(corners[:1], 0, chain, [(low, low) for low, _ in box])
        for (p, q), *_ in region.rings:
            demand(question.floor.side([(x + p, y + q)], error) > 0, where, f"{body} is outside the floor")
    for one, other in ((question.pieces[i], question.pieces[j]) for i, j in question.pairs):
        motion, gap = relative(one.chain, other.chain), one.radius + other.radius
        apart = free(one.corners, gap, motion, box, [other.corners], plane.apart)
        demand(apart, where, f"{one.body} may touch {other.body}")
