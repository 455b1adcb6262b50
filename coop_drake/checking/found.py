"""A plan holds: cells are free, each leads to the next, the first holds the start, the last the goal."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import Any

from coop_drake.checking.plane import (
    ONE,
    TURN,
    Point,
    Region,
    apart,
    box_of,
    boxes_apart,
    demand,
    hull,
    norm,
    numbers,
)
from coop_drake.checking.team import Interval, Open, Piece, Question, Step, bisect, swept

ROUNDING = 10**9
"""Stated lengths may be wrong by one part in so many, for they are rounded [-]."""

NARROWEST = ONE // 10**9
"""Goal intervals are no narrower than this: nothing could come to rest inside [rad, m]."""


def check_plan(question: Question, answer: Any, progress: Any) -> list[tuple[str, int]]:
    """Check a plan; returns the statements that hold and how often each was checked."""
    cells, transitions, axes = answer["cells"], answer["transitions"], 1 + len(question.limits)
    boxes = [intervals(cell, "", axes) for cell in cells]
    regions = [Region(cell["tidied"]) for cell in cells]
    entry, count = (question.start[0], question.start[1]), len(cells)
    demand(0 < count == len(transitions), "transitions", "are not as many as the cells")
    started = holds(boxes[0], [(value, value) for value in question.start[2:]])
    demand(started, "cells[0]", "does not hold the start's angles")
    for k, transition in enumerate(transitions):
        demand(holds(question.limits, boxes[k][1:]), f"cells[{k}]", "leaves the limits of a joint")
        here, where = slice(k, k + 2), f"transitions[{k}]"
        entry = _check_transition(transition, where, entry, boxes[here], regions[here])
    _check_goal(question, transitions[-1], entry)
    for k in range(count):
        _check_free(question, boxes[k], regions[k], f"cells[{k}]")
        progress("checking cells", (k + 1) / count)
    return [
        ("joint intervals lie within the joints' limits", count * (axes - 1)),
        ("each transition ends inside its cell and the next, in intervals of both", 2 * count - 1),
        ("a path to each target has the stated length and distance from the cell's boundary", count),
        ("the start lies in the first cell, the goal at the end of the last transition", 2),
        ("no piece meets a wall at any configuration of any cell", count * len(question.pieces)),
        ("no two pieces of a pair meet at any configuration of any cell", count * len(question.pairs)),
    ]


def intervals(value: Any, prefix: str, axes: int, least: int = 1) -> list[Interval]:
    """Read the intervals of (theta, q...) at ``prefix`` + lower and upper, not narrower than ``least``."""
    low, high = (numbers(value[prefix + end], axes) for end in ("lower", "upper"))
    wide = all(b - a >= least for a, b in zip(low, high, strict=True))
    demand(wide, f"{prefix}upper", "is below lower, or too near to it")
    return list(zip(low, high, strict=True))


def holds(outer: Sequence[Interval], inner: Sequence[Interval]) -> bool:
    """Whether intervals hold others, axis by axis."""
    return all(a[0] <= b[0] and b[1] <= a[1] for a, b in zip(outer, inner, strict=True))


def _check_transition(
    value: Any, where: str, entry: Point, boxes: list[list[Interval]], regions: list[Region]
) -> Point:
    """Check that a transition leads from its entry to a target in its cell and the next; returns it."""
    goals = intervals(value, "goal_", len(boxes[0]), NARROWEST)
    demand(all(holds(box, goals) for box in boxes), f"{where}.goal_lower", "leaves the cell or the next one")
    radius, neck, length = numbers([value["inradius"], value["neck"], value["length"]], 3)
    path = [(x, y) for x, y in (numbers(point, 2) for point in value["path"])]
    (x, y), parts = numbers(value["target"], 2), list(pairwise(path))
    joined = len(parts) > 0 and path[0] == entry and path[-1] == (x, y)
    demand(joined, f"{where}.path", "does not lead from the entry to the target")
    kept, clear = (stated - stated // ROUNDING - 1 for stated in (radius, neck))
    inside = kept >= 0 and all(region.holds([(x, y)], kept) for region in regions)
    demand(inside, f"{where}.inradius", "is not positive, or more than the target's distance from a boundary")
    inside = clear >= 0 and all(regions[0].holds(hull(part), clear) for part in parts)
    demand(inside, f"{where}.neck", "is not positive, or more than the path's distance from the boundary")
    off = length - sum(norm([(b[0] - a[0], b[1] - a[1])]) for a, b in parts)
    demand(abs(off) <= (length + ONE) // ROUNDING, f"{where}.length", "is not that of the path")
    return x, y


def _check_goal(question: Question, value: Any, target: Point) -> None:
    """Check that the last transition ends at the goal, within the tolerances."""
    where, goals = "transitions[-1]", intervals(value, "goal_", len(question.goal_box))
    demand(target == (question.goal[0], question.goal[1]), f"{where}.target", "is not the goal's position")
    demand(numbers([value["inradius"]], 1)[0] <= question.room, where, "has an inradius beyond the tolerance")
    turns = (goals[0][0] + goals[0][1] - 2 * question.goal[2] + TURN) // (2 * TURN)
    for axis, (goal, (aim, _), room) in enumerate(zip(goals, question.goal_box, question.rooms, strict=True)):
        if room is not None:
            middle, off = (aim, 0) if axis else (aim + turns * TURN, abs(turns))  # A turn is wrong by a unit.
            near = middle - room + off <= goal[0] and goal[1] <= middle + room - off
            demand(near, f"{where}.goal_lower", f"or goal_upper is beyond the tolerance on axis {axis}")


def _check_free(question: Question, box: list[Interval], region: Region, where: str) -> None:
    """Check that no piece meets a wall, and no two pieces of a pair each other, anywhere in a cell.

    A piece that meets no wall lies inside the floor if one of its points does. As it moves without meeting a
    wall, that needs to be tested at one configuration for each ring of the cell: each part of it has a ring.
    """
    floor = question.floor
    for piece in question.pieces:
        steps, walls = question.steps(piece.component), list(range(len(floor.edges)))
        met = partial(_walls_met, floor, region, piece, steps)
        bisect(box, walls, met, where, f"{piece.body} may touch a wall")
        points, error, _ = swept(piece.vertices[:1], steps, [(low, low) for low, _ in box])
        for (x, y), *_ in region.rings:
            on_floor = floor.holds([(x + points[0][0], y + points[0][1])], error)
            demand(on_floor, where, f"{piece.body} stands outside the floor")
    for pair in question.pairs:
        pieces, common = [question.pieces[k] for k in pair], question.common(pair)
        chains = [question.steps(piece.component, common) for piece in pieces]
        finding = " may touch ".join(piece.body for piece in pieces)
        bisect(box, [0], partial(_pair_met, pieces, chains), where, finding)


def _walls_met(
    floor: Region, region: Region, piece: Piece, steps: list[Step], part: list[Interval], walls: list[int]
) -> Open:
    """Walls that an enclosure F of a piece may meet: positions near the Minkowski sum of the wall and -F."""
    points, error, spread = swept(piece.vertices, steps, part)
    gap, (x0, y0, x1, y1) = piece.radius + error, box_of(points)
    reach = region.box[0] + x0, region.box[1] + y0, region.box[2] + x1, region.box[3] + y1
    near = [wall for wall in walls if not boxes_apart(floor.boxes[wall], reach, gap)]
    sums = [hull((ex - x, ey - y) for ex, ey in floor.edges[wall] for x, y in points) for wall in near]
    return [wall for wall, ends in zip(near, sums, strict=True) if not region.clear_of(ends, gap)], spread


def _pair_met(pieces: list[Piece], chains: list[list[Step]], part: list[Interval], tested: list[int]) -> Open:
    """Whether enclosures of two pieces may meet in the frame of their common component."""
    (one, e1, spread), (other, e2, more) = map(swept, [p.vertices for p in pieces], chains, [part, part])
    gap = pieces[0].radius + pieces[1].radius + e1 + e2
    clear = boxes_apart(box_of(one), box_of(other), gap) or apart(one, other, gap)
    return [] if clear else tested, spread | more
