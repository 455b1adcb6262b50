"""Channels written by hand, without a search, and a cell with everything that maps dislike."""

import numpy as np
from shapely import Point, Polygon, box, union_all

from coop_drake.geometry import pole
from coop_drake.planning.cells.cells import FreeBox
from coop_drake.planning.channel import Channel
from tests.support.cases import case

MARGIN = 0.05


def bent_channel(cells=8, radius=0.32):
    """Boxes of angles along the base case's floor, each with the floor shrunk by its own radius as polygon.

    Returns:
        The problem and a channel for it: the angle goes evenly from start to goal, joints stay near zero.
    """
    problem = case("base")
    start, goal = problem.start[2], problem.goal_pose[2]
    width = (goal - start) / (cells - 1)
    boxes = []
    for k in range(cells):
        room = radius + 0.02 * (k % 3)
        middle = start + k * width
        lower = np.array([middle - 0.7 * width, -0.3 + 0.05 * (k % 2), -0.3])
        upper = np.array([middle + 0.7 * width, 0.3, 0.3 + 0.05 * (k % 2)])
        polygon = part_at(problem.workspace.buffer(-room), problem.start[:2])
        boxes.append(FreeBox(polygon, lower, upper))
    return problem, Channel(tuple(boxes), float(goal), margin=MARGIN)


def part_at(shape, point):
    """The polygon of a shape that holds a point."""
    parts = shape.geoms if hasattr(shape, "geoms") else (shape,)
    return next(part for part in parts if part.contains(Point(point)))


def untidy_cell():
    """A corridor with a bend, a pillar, a niche, a cusp, a sliver and fifty idle vertices on one wall."""
    halls = [box(0, 0, 1, 4), box(0, 3.2, 4, 4), box(3.4, 0, 4.4, 4)]
    sliver = box(-1.0, 1.0, 0.001, 1.01)
    cusp = Polygon([(0.9, 0.5), (3.0, 0.501), (0.9, 0.52)])
    floor = union_all([*halls, sliver, cusp]).difference(box(1.5, 3.4, 1.9, 3.7)).buffer(0.0)
    outer = [(x, 4.0) for x in np.linspace(2.0, 3.0, 50)]
    assert isinstance(floor, Polygon)
    return floor.union(Polygon([(2.0, 3.9), (3.0, 3.9), *reversed(outer)]))


def middle(polygon):
    """A point well inside."""
    return pole(polygon)[0]
