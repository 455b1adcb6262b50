"""A proof holds: forbidden sets and cells cover all configurations, labels part start from goal."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import prod
from typing import Any, NamedTuple

from coop_drake.checking.cover import OpenSet, blocked, check_cover
from coop_drake.checking.found import holds, intervals
from coop_drake.checking.numbers import ONE, TURN, RefusedError, index, numbers, spend
from coop_drake.checking.planar import Point, Region, hull, within
from coop_drake.checking.team import Interval, Open, Piece, Question, Step, bisect, swept

WIDENING = ONE >> 40
"""Slices are widened by this on either side: ends of a turn in doubles are off by less [rad, m]."""


class Carrier(NamedTuple):
    """Whose positions a proof is about: a point of a component; the axes that are kept."""

    component: int
    point: Point
    axes: list[int]


class Slice(NamedTuple):
    """Intervals of the kept axes, widened ones of all (None if not kept), cells, labels, forbidden sets."""

    where: str
    box: list[Interval]
    wide: list[Any]
    cells: list[Region]
    reached: list[bool]
    forbidden: list[OpenSet]
    overlap: bool


def check_proof(question: Question, answer: Any, progress: Any) -> list[tuple[str, int]]:
    """Check a proof that no plan exists; returns the statements that hold and how often each was checked."""
    kind, carrier = answer["kind"], Carrier(0, (0, 0), [0])
    if kind == "disc":
        x, y = numbers(answer["centre"], 2)
        carrier = Carrier(index(answer["component"], len(question.parents)), (x, y), [0])
    elif kind in ("slices", "blocked goal"):
        carrier.axes.extend(1 + k for k, robot in enumerate(question.robots) if robot in answer["robots"])
    else:
        raise RefusedError("kind", "is none of slices, disc and blocked goal")
    at_goal, slices = kind == "blocked goal", []
    for k, value in enumerate(answer["slices"]):
        slices.append(_read_slice(question, carrier, value, f"slices[{k}]", at_goal=at_goal))
        progress("checking inner sweeps", (k + 1) / len(answer["slices"]))
    if kind == "disc" and len(slices) != 1:
        raise RefusedError("slices", "of a disc are not one for all angles")
    ends = min(part.box[0][0] for part in slices), max(part.box[0][1] for part in slices)
    length, middle = (0, question.goal[2]) if at_goal else (TURN, (ends[0] + ends[1]) // 2)
    turns = (ends[0] + ends[1] - 2 * middle + TURN) // (2 * TURN)
    if max(abs(ends[1] - ends[0] - length), abs(ends[0] + ends[1] - 2 * (middle + turns * TURN))) > WIDENING:
        raise RefusedError("slices", "are not about a whole turn, or about the goal's angle")
    ranges = question.goal_box if at_goal else [ends, *question.limits]
    facets = _facets([part.box for part in slices], [ends, *[ranges[axis] for axis in carrier.axes[1:]]])
    edges = 0
    for k, part in enumerate(slices):
        if not part.overlap and not at_goal:
            edges += check_cover(part.cells, part.forbidden, part.where)
        elif not part.overlap and not any(
            s.stretches([(question.goal[0], question.goal[1])] * 2) for s in part.forbidden
        ):
            raise RefusedError(part.where, "the team may be free at the goal's position")
        progress("checking slices", (k + 1) / len(slices))
    labels = 0 if at_goal else _check_labels(question, carrier, slices, facets)
    return [
        ("slices tile the angles and the limits of the kept joints", len(slices)),
        ("polygons lie inside their pieces in all of their slice; or two pieces meet there", len(slices)),
        ("the team collides at the goal in each slice", len(slices) * at_goal),
        (
            "edges of cells and of forbidden positions lie inside others: together they are all positions",
            edges,
        ),
        ("cells that touch have one label, the start's is reached and the goal's is not", labels),
    ]


def _read_slice(question: Question, carrier: Carrier, value: Any, where: str, *, at_goal: bool) -> Slice:
    """Read a slice; check that pieces hold its polygons, and two pieces of a pair its point."""
    box = intervals(value, "", len(carrier.axes), 0)
    wide: list[Any] = [None] * (1 + len(question.limits))
    for axis, (low, high) in zip(carrier.axes, box, strict=True):
        wide[axis] = (low - WIDENING, high + WIDENING)
    cells = [] if at_goal else value["cells"]
    labels, forbidden = [cell["reached"] for cell in cells], []
    if not all(isinstance(label, bool) for label in labels):
        raise RefusedError(f"{where}.cells", "have labels that are neither true nor false")
    for overlap in value["overlaps"]:
        pair = tuple(overlap["pieces"])
        if pair not in question.pairs:
            raise RefusedError(f"{where}.overlap", "is of two pieces that may meet")
        x, y = numbers(overlap["point"], 2)
        for k in pair:
            steps = question.steps(question.pieces[k].component, question.common(pair))
            _check_held(question.pieces[k], steps, [(x, y)], wide, f"{where}.overlap")
    for sweep in value["inner_sweeps"]:
        piece = question.pieces[index(sweep["piece"], len(question.pieces))]
        ring = hull((x, y) for x, y in (numbers(corner, 2) for corner in sweep["polygon"]))
        steps = question.steps(piece.component)
        if carrier.component or carrier.point != (0, 0):
            if piece.component != carrier.component:
                raise RefusedError(
                    f"{where}.inner_sweeps", "name a piece of another component than the disc's"
                )
            steps = [Step(offset=(-carrier.point[0], -carrier.point[1])), Step(0, 1)]
        _check_held(piece, steps, ring, wide, f"{where}.inner_sweeps")
        forbidden += blocked(question.floor, ring)
    regions = [Region(cell["polygon"]) for cell in cells]
    return Slice(where, box, wide, regions, labels, forbidden, bool(value["overlaps"]))


def _check_held(piece: Piece, steps: list[Step], points: list[Point], box: list[Any], where: str) -> None:
    """Check that points, seen from a piece that moves by steps, stay inside it all over a box."""
    if any(step.axis >= 0 and box[step.axis] is None for step in steps):
        raise RefusedError(where, "name a piece that a joint moves which is not kept")

    def leaves(part: list[Interval], open_: list[int]) -> Open:
        moved, error, spread = swept(points, [step.backwards() for step in reversed(steps)], part)
        return [] if within(moved, piece.vertices, error - piece.radius) else open_, spread

    bisect(box, [0], leaves, where, f"may leave the inside of {piece.body}")


def _check_labels(
    question: Question, carrier: Carrier, slices: list[Slice], facets: list[tuple[int, int]]
) -> int:
    """Check that touching cells have one label, and that start and goal lie in no cell of the wrong one."""
    count = 0
    for a, b in [*facets, *[(k, k) for k in range(len(slices))]]:
        for i, j in ((i, j) for i in range(len(slices[a].cells)) for j in range(len(slices[b].cells))):
            if slices[a].reached[i] != slices[b].reached[j]:
                count += 1
                if slices[a].cells[i].touches(slices[b].cells[j]):
                    raise RefusedError(
                        f"{slices[a].where}.cells[{i}]",
                        f"touches {slices[b].where}.cells[{j}]; one is reached",
                    )
    start = [(value, value) for value in question.start[2:]]
    for box, place, wrong in ((start, question.start, False), (question.goal_box, question.goal, True)):
        steps = [*question.steps(carrier.component), Step(offset=(place[0], place[1]))]
        for part in slices:
            cells = [k for k, label in enumerate(part.reached) if label == wrong]
            finding = f"cells may hold the {'goal' if wrong else 'start'} and have reached: {wrong}"
            if _meets(part.wide, box):
                bisect(box, cells, partial(_held, carrier.point, steps, part), part.where, finding)
    return count


def _held(point: Point, steps: list[Step], part: Slice, box: list[Interval], cells: list[int]) -> Open:
    """Cells that a point may lie in when steps carry it, and what to halve."""
    places, error, spread = swept([point], steps, box)
    return [k for k in cells if not part.cells[k].clear_of(places, error)], spread


def _meets(wide: list[Any], ends: list[Interval]) -> bool:
    """Whether a widened slice meets intervals of (theta, q...) on all kept axes; theta modulo a turn."""
    turns = (wide[0][0] + wide[0][1] - 2 * ends[0][0] + TURN) // (2 * TURN)
    places = [(ends[0][0] + k * TURN,) * 2 for k in (turns - 1, turns, turns + 1)]
    rest = zip(wide[1:], ends[1:], strict=True)
    return any(_meet(wide[0], place) for place in places) and all(a is None or _meet(a, b) for a, b in rest)


def _meet(one: Interval, other: Interval) -> bool:
    return one[0] <= other[1] and other[0] <= one[1]


def _facets(boxes: Sequence[Sequence[Interval]], whole: Sequence[Interval]) -> list[tuple[int, int]]:
    """Check that boxes tile a range; returns pairs that share a facet, across the ends of theta too.

    Boxes within a range whose interiors are disjoint tile it if their volumes add up to its volume. An axis
    on which the range is a single value does not count.
    """
    wide = [axis for axis, (low, high) in enumerate(whole) if low < high]
    inside = all(holds(whole, box) for box in boxes)
    volume = sum(prod(box[a][1] - box[a][0] for a in wide) for box in boxes)
    if not inside or volume != prod(whole[a][1] - whole[a][0] for a in wide):
        raise RefusedError("slices", "do not tile their range: they leave it, leave a gap or overlap")
    sorting = max(range(len(whole)), key=lambda a: len({box[a][0] for box in boxes}))
    order, pairs = sorted(range(len(boxes)), key=lambda k: boxes[k][sorting]), []
    for place, i in enumerate(order):
        one = boxes[i]
        for j in order[place + 1 :]:
            other = boxes[j]
            if other[sorting][0] > one[sorting][1]:
                break
            spend(1)
            if all(map(_meet, one, other)):
                touching = sum(one[a][0] == other[a][1] or other[a][0] == one[a][1] for a in wide)
                if touching == 0:
                    raise RefusedError(f"slices[{i}], slices[{j}]", "overlap")
                pairs += [(i, j)] * (touching == 1)
    begins = [k for k, box in enumerate(boxes) if box[0][0] == whole[0][0]]
    ends = [k for k, box in enumerate(boxes) if box[0][1] == whole[0][1]]
    return pairs + [(i, j) for i in ends for j in begins if all(map(_meet, boxes[i][1:], boxes[j][1:]))]
