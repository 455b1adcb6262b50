"""A proof holds: forbidden sets and cells cover all configurations, labels part start from goal."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import prod
from typing import Any, NamedTuple

from coop_drake.checking.cover import OpenSet, blocked, check_cover
from coop_drake.checking.found import holds, intervals
from coop_drake.checking.plane import ONE, TURN, Point, Region, demand, hull, index, numbers, spend, within
from coop_drake.checking.team import Interval, Open, Question, Step, backwards, bisect, swept

WIDENING = ONE >> 40
"""Slices are widened by this on either side: ends of a turn in doubles are off by less [rad, m]."""


class Part(NamedTuple):
    """A slice: kept intervals, widened ones of all axes (None if not kept), cells, labels, forbidden sets."""

    where: str
    box: list[Interval]
    wide: list[Any]
    cells: list[Region]
    reached: list[bool]
    forbidden: list[OpenSet]
    overlap: bool


def check_proof(question: Question, answer: Any, progress: Any) -> list[tuple[str, int]]:
    """Check a proof that no plan exists; returns the statements that hold and how often each was checked."""
    kind, axes, carrier, parts = answer["kind"], [0], (0, (0, 0)), []
    demand(kind in ("slices", "disc", "blocked goal"), "kind", "is unknown")
    if kind == "disc":
        x, y = numbers(answer["centre"], 2)
        carrier = index(answer["component"], len(question.parents)), (x, y)
    else:
        axes += [1 + k for k, robot in enumerate(question.robots) if robot in answer["robots"]]
    at_goal, count = kind == "blocked goal", len(answer["slices"])
    demand(count == 1 or (kind != "disc" and count > 0), "slices", "are none, or more than one for a disc")
    for k, value in enumerate(answer["slices"]):
        parts.append(_read(question, carrier, axes, value, f"slices[{k}]", at_goal=at_goal))
        progress("checking inner sweeps", (k + 1) / count)
    ends = min(part.box[0][0] for part in parts), max(part.box[0][1] for part in parts)
    length, middle = (0, question.goal[2]) if at_goal else (TURN, (ends[0] + ends[1]) // 2)
    turns = (ends[0] + ends[1] - 2 * middle + TURN) // (2 * TURN)
    off = max(abs(ends[1] - ends[0] - length), abs(ends[0] + ends[1] - 2 * (middle + turns * TURN)))
    demand(off <= WIDENING, "slices", "are not about a whole turn, or about the goal's angle")
    ranges = question.goal_box if at_goal else [ends, *question.limits]
    facets = _facets([part.box for part in parts], [ends, *[ranges[axis] for axis in axes[1:]]])
    edges, goal = 0, (question.goal[0], question.goal[1])
    for k, part in enumerate(parts):
        if at_goal and not part.overlap:
            collides = any(one.stretches((goal, goal)) for one in part.forbidden)
            demand(collides, part.where, "the team may be free at the goal's position")
        elif not part.overlap:
            edges += check_cover(part.cells, part.forbidden, part.where)
        progress("checking slices", (k + 1) / count)
    labels = 0 if at_goal else _check_labels(question, carrier, parts, facets)
    return [
        ("slices tile the angles and the limits of the kept joints", count),
        ("polygons lie inside their pieces in all of their slice; or two pieces meet there", count),
        ("the team collides at the goal in each slice", count * at_goal),
        ("edges of cells and of forbidden positions lie inside others: they are all positions", edges),
        ("cells that touch have one label, the start's is reached and the goal's is not", labels),
    ]


def _read(
    question: Question, carrier: tuple[int, Point], axes: list[int], value: Any, where: str, *, at_goal: bool
) -> Part:
    """Read a slice; check that pieces hold its polygons, and two pieces of a pair its points."""
    box, wide = intervals(value, "", len(axes), 0), list[Any]([None] * (1 + len(question.limits)))
    for axis, (low, high) in zip(axes, box, strict=True):
        wide[axis] = (low - WIDENING, high + WIDENING)
    cells, forbidden = [] if at_goal else value["cells"], list[OpenSet]()
    labels = [cell["reached"] for cell in cells]
    demand(all(isinstance(label, bool) for label in labels), where, "has labels that are no truth values")
    for overlap in value["overlaps"]:
        pair, (x, y) = tuple(overlap["pieces"]), numbers(overlap["point"], 2)
        demand(pair in question.pairs, f"{where}.overlaps", "are of pieces that may meet")
        for k in pair:
            steps = question.steps(question.pieces[k].component, question.common(pair))
            _check_held(question, k, steps, [(x, y)], wide, f"{where}.overlaps")
    for sweep in value["inner_sweeps"]:
        ring = hull([(x, y) for x, y in (numbers(corner, 2) for corner in sweep["polygon"])])
        piece = index(sweep["piece"], len(question.pieces))
        steps = question.steps(question.pieces[piece].component)
        if carrier != (0, (0, 0)):
            same, (x, y) = question.pieces[piece].component == carrier[0], carrier[1]
            demand(same, f"{where}.inner_sweeps", "name a piece of another component than the disc's")
            steps = [Step(offset=(-x, -y)), Step(0, 1)]
        _check_held(question, piece, steps, ring, wide, f"{where}.inner_sweeps")
        forbidden += blocked(question.floor, ring)
    regions = [Region(cell["polygon"]) for cell in cells]
    return Part(where, box, wide, regions, labels, forbidden, len(value["overlaps"]) > 0)


def _check_held(
    question: Question, piece: int, steps: list[Step], points: list[Point], box: list[Any], where: str
) -> None:
    """Check that points, seen from a piece that moves by steps, stay inside it all over a box."""
    body, _, vertices, radius = question.pieces[piece]
    kept = all(step.axis < 0 or box[step.axis] is not None for step in steps)
    demand(kept, where, "name a piece that a joint moves which is not kept")

    def leaves(part: list[Interval], tested: list[int]) -> Open:
        moved, error, spread = swept(points, backwards(steps), part)
        return [] if within(moved, vertices, error - radius) else tested, spread

    bisect(box, [0], leaves, where, f"may leave the inside of {body}")


def _check_labels(
    question: Question, carrier: tuple[int, Point], parts: list[Part], facets: list[tuple[int, int]]
) -> int:
    """Check that touching cells have one label, and that start and goal lie in no cell of the wrong one."""
    count, angles = 0, [(value, value) for value in question.start[2:]]
    for one, other in [*[(parts[a], parts[b]) for a, b in facets], *zip(parts, parts, strict=True)]:
        for i, j in ((i, j) for i in range(len(one.cells)) for j in range(len(other.cells))):
            if one.reached[i] != other.reached[j]:
                finding = f"touches {other.where}.cells[{j}], which has another label"
                demand(not one.cells[i].touches(other.cells[j]), f"{one.where}.cells[{i}]", finding)
                count += 1
    for box, place, wrong in ((angles, question.start, False), (question.goal_box, question.goal, True)):
        steps = [*question.steps(carrier[0]), Step(offset=(place[0], place[1]))]
        for part in parts:
            cells = [k for k, label in enumerate(part.reached) if label == wrong]
            finding = f"cells may hold the {'goal' if wrong else 'start'} and have reached: {wrong}"
            if _may_hold(part.wide, box):
                bisect(box, cells, partial(_held, carrier[1], steps, part), part.where, finding)
    return count


def _held(point: Point, steps: list[Step], part: Part, box: list[Interval], cells: list[int]) -> Open:
    """Cells that a point may lie in when steps carry it, and what to halve."""
    places, error, spread = swept([point], steps, box)
    return [k for k in cells if not part.cells[k].clear_of(places, error)], spread


def _may_hold(wide: list[Any], ends: list[Interval]) -> bool:
    """Whether a widened slice meets intervals of (theta, q...) on all kept axes; theta modulo a turn."""
    (low, high), theta, kept = wide[0], ends[0][0], zip(wide[1:], ends[1:], strict=True)
    turns = (low + high - 2 * theta + TURN) // (2 * TURN)
    held = any(low <= theta + k * TURN <= high for k in (turns - 1, turns, turns + 1))
    return held and all(a is None or (a[0] <= b[1] and b[0] <= a[1]) for a, b in kept)


def _facets(boxes: Sequence[Sequence[Interval]], whole: Sequence[Interval]) -> list[tuple[int, int]]:
    """Check that boxes tile a range; returns pairs that share a facet, across the ends of theta too.

    Boxes within a range whose interiors are disjoint tile it if their volumes add up to its volume. An axis
    on which the range is a single value does not count.
    """
    wide, pairs = [axis for axis, (low, high) in enumerate(whole) if low < high], list[tuple[int, int]]()
    volume, *volumes = (prod(box[a][1] - box[a][0] for a in wide) for box in (whole, *boxes))
    tiled = all(holds(whole, box) for box in boxes) and sum(volumes) == volume
    demand(tiled, "slices", "do not tile their range: they leave it, leave a gap or overlap")
    sorting = max(range(len(whole)), key=lambda a: len({box[a][0] for box in boxes}))
    order = sorted(range(len(boxes)), key=lambda k: boxes[k][sorting])
    for place, i in enumerate(order):
        for j in order[place + 1 :]:
            spend(1)
            if boxes[j][sorting][0] > boxes[i][sorting][1]:
                break
            shared = [_shared(boxes[i][a], boxes[j][a]) for a in wide]
            demand(min(shared, default=1) <= 0, f"slices[{i}], slices[{j}]", "overlap")
            if min(shared) == 0 and shared.count(0) == 1:
                pairs.append((i, j))
    begins = [k for k, box in enumerate(boxes) if box[0][0] == whole[0][0]]
    ends = [k for k, box in enumerate(boxes) if box[0][1] == whole[0][1]]
    rest = [axis for axis in wide if axis > 0]
    across = [(i, j) for i in ends for j in begins]
    return pairs + [(i, j) for i, j in across if all(_shared(boxes[i][a], boxes[j][a]) > 0 for a in rest)]


def _shared(one: Interval, other: Interval) -> int:
    return min(one[1], other[1]) - max(one[0], other[0])
