"""Joints without limits are circles: what tiles a turn, who is beside whom, what is met modulo turns."""

import json
from itertools import product
from math import cos, pi, sin
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coop_drake.checking import RefusedError, check, plane
from coop_drake.checking.infeasible import WIDENING, _facets
from coop_drake.checking.plane import ONE, TURN
from coop_drake.checking.team import Question
from tests.checking.test_check import PROOF, QUESTION, altered, plan, rectangle, refused

LIMITS = (-ONE, 2 * ONE)

TURRET = {
    **QUESTION,
    "floor": rectangle(0, 0, 8, 8),
    "lower": [None], "upper": [None],
    "components": [{"parent": 0, "joint": 0, "sign": 1, "angle": 0, "slide": [0, 0], "offset": [0.5, 0]}],
    "pieces": [
        {"body": "object", "component": 0, "corners": [[0, 0]], "radius": 0.3},
        {"body": "arm", "component": 1, "corners": [[0.1, 0]], "radius": 0.1},
    ],
    "start": [2, 4, 0, 3.0], "goal": [3, 4], "goal_lower": [0, -3.1], "goal_upper": [0, -3.1],
    "tolerances": [0.01, 0.02, 0.02], "left_aside": [[0, 1, "joint"]],
}  # fmt: skip


def turned(lower, upper, *goal):
    """The plan whose one cell has these values of the joint, and these goals in it."""
    found = plan(lower, upper)
    found["transitions"][0].update(goal_lower=[-0.01, goal[0]], goal_upper=[0.01, goal[1]])
    return found


def tiles(splits, circles, axes=3):
    """Boxes that tile a range: each split halves one, or parts it as one to three."""
    whole = [(-(TURN // 2), TURN - TURN // 2) if axis in circles else LIMITS for axis in range(axes)]
    boxes = [whole]
    for pick, axis, quarters in splits:
        box = boxes.pop(pick % len(boxes))
        low, high = box[axis % axes]
        middle = low + (high - low) * quarters // 4
        parts = ((low, middle), (middle, high))
        boxes += [[*box[: axis % axes], part, *box[axis % axes + 1 :]] for part in parts]
    return boxes


def beside(one, other, circles):
    """Whether two boxes share a facet, in one of the places that whole turns lead to."""
    for turns in product(*[(-TURN, 0, TURN) if axis in circles else (0,) for axis in range(len(one))]):
        moved = [(low + turn, high + turn) for (low, high), turn in zip(other, turns, strict=True)]
        shared = [min(a[1], b[1]) - max(a[0], b[0]) for a, b in zip(one, moved, strict=True)]
        if min(shared) == 0 and shared.count(0) == 1:
            return True
    return False


def facets(boxes, circles, axes=3):
    """What the checker finds beside each other, of a question with such axes."""
    plane.work_left[0] = 10**7
    limits = [(-(2**20) * ONE, 2**20 * ONE) if axis in circles else LIMITS for axis in range(1, axes)]
    return _facets(boxes, SimpleNamespace(circles=circles, limits=limits))


SPLITS = st.lists(st.tuples(st.integers(0, 50), st.integers(0, 2), st.integers(1, 3)), max_size=9)
CIRCLES = st.sampled_from([{0}, {0, 1}, {0, 2}, {0, 1, 2}])


@given(SPLITS, CIRCLES)
def test_slices_beside_each_other_on_any_circle_share_a_facet(splits, circles):
    boxes = tiles(splits, circles)
    found = {tuple(sorted(pair)) for pair in facets(boxes, circles)}
    numbers = range(len(boxes))
    expected = {(i, j) for i in numbers for j in numbers if i <= j and beside(boxes[i], boxes[j], circles)}
    assert found == expected


@given(SPLITS.filter(bool), CIRCLES, st.integers(0, 50))
def test_a_cover_without_one_slice_or_with_one_twice_is_refused(splits, circles, pick):
    boxes = tiles(splits, circles)
    one = boxes[pick % len(boxes)]
    for wrong in ([box for box in boxes if box is not one], [*boxes, one]):
        with pytest.raises(RefusedError):
            facets(wrong, circles)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("off", [-2 * WIDENING, 2 * WIDENING, TURN])
def test_less_or_more_than_a_turn_of_a_circle_is_refused(axis, off):
    box = [[(0, TURN), (0, TURN), LIMITS][k] for k in range(3)]
    box[axis] = (0, TURN + off)
    with pytest.raises(RefusedError, match="whole turn"):
        facets([box], {0, 1})


@pytest.mark.parametrize("turns", [0, 1, -3])
def test_a_plan_turns_a_joint_through_pi_and_its_goal_is_met_modulo_a_turn(turns):
    start = 3.0 + turns * 2.0 * pi
    asked = altered(TURRET, [2, 4, 0, start], "start")
    middle = start + 0.18318530717958612
    held = turned(start - 0.1, middle + 0.1, middle - 0.01, middle + 0.01)
    assert check(asked, held)
    other = turned(start - 0.1, middle + 0.1, middle - 0.01, middle + 0.03)
    assert "leaves a cell or the tolerance" in refused(asked, other)
    limited = {**asked, "lower": [-30.0], "upper": [30.0]}
    assert "leaves a cell or the tolerance" in refused(limited, held)


def test_any_value_is_the_goal_of_a_circle_without_one_and_a_plan_may_end_in_many_turns():
    free = altered(altered(TURRET, [0, None], "goal_lower"), [0, None], "goal_upper")
    assert check(free, turned(-20.0, 20.0, -19.0, 19.0))
    assert check(free, turned(2.9, 3.1, 2.95, 3.05))


POSTS = {
    **TURRET,
    "pieces": [
        {"body": "arm", "component": 1, "corners": [[0.3, 0]], "radius": 0.1},
        {"body": "front", "component": 0, "corners": [[0.9, 0]], "radius": 0.35},
        {"body": "back", "component": 0, "corners": [[0.1, 0]], "radius": 0.35},
        {"body": "object", "component": 0, "corners": [[0, 0]], "radius": 0.3},
    ],
    "left_aside": [[0, 3, "model"]], "start": [2, 4, 0, 1.5],
}  # fmt: skip
"""An arm that turns between a post in front of it and one behind it."""

FRONT = [(low, low + 0.5, 1) for low in (-1.0, -0.5, 0.0, 0.5)]
BACK = [(low, low + 0.5, 2) for low in (2.25, 2.75, 3.25, 3.75)]


def locked(parts):
    """A proof by slices of the joint: each has one cell with a label, or the number of the post touched."""
    slices = []
    for lower, upper, label in parts:
        middle = 0.5 * (lower + upper)
        shared = {"pieces": [0, label], "component": 0}
        shared["polygon"] = [[0.5 + 0.3 * cos(middle), 0.3 * sin(middle)]]
        whole = {"pieces": [3], "component": 0, "polygon": [[-0.1, -0.1], [0.1, -0.1], [0, 0.1]]}
        cells = [{"reached": label, "polygon": rectangle(-1, -1, 9, 9)}]
        open_part = isinstance(label, bool)
        ends = {"lower": [-pi, lower], "upper": [pi, upper]}
        kept = cells if open_part else []
        slices.append({**ends, "witnesses": [whole if open_part else shared], "cells": kept})
    return {**PROOF, "slices": slices}


def aimed(question, value):
    """The question with this value of the joint at the goal."""
    return {**question, "goal_lower": [0, value], "goal_upper": [0, value]}


def test_a_proof_that_leaves_the_seam_open_holds_for_limits_of_half_a_turn_and_not_for_a_circle():
    question, forged = aimed(POSTS, -1.5), locked([(-pi, -1.0, False), *FRONT, (1.0, pi, True)])
    apart = {**question, "pieces": [*question["pieces"][:2], *question["pieces"][3:]]}
    apart["left_aside"] = [[0, 2, "model"]]
    forged = json.loads(json.dumps(forged).replace('"pieces": [3]', '"pieces": [2]'))
    assert check({**apart, "lower": [-pi], "upper": [pi]}, forged)
    assert "another label" in refused(apart, forged)


def test_a_proof_that_locks_both_ways_round_a_circle_holds_wherever_its_slices_begin():
    parts = [(-2.0, -1.0, False), *FRONT, (1.0, 2.25, True), *BACK, (4.25, 2.0 * pi - 2.0, False)]
    question = aimed(POSTS, -1.5 + 6.0 * pi)
    assert check(question, locked(parts))
    assert "whole turn" in refused(question, locked(parts[:-1]))
    assert "gap" in refused(question, locked(parts[:5] + parts[6:]))
    opened = [(low, high, True if label == 2 else label) for low, high, label in parts]
    assert "another label" in refused(question, locked(opened))
    assert "may hold the goal" in refused(aimed(question, 1.6 - 4.0 * pi), locked(parts))
    assert "may hold the goal" in refused(aimed(question, None), locked(parts))


@pytest.mark.parametrize(
    ("question", "finding"),
    [
        (altered(TURRET, [-1.0], "lower"), "numbers"),
        (altered(TURRET, [2.0], "upper"), "numbers"),
        (altered(TURRET, [1, 0], "components", 0, "slide"), "circle"),
        (altered(TURRET, [0, None], "goal_lower"), "numbers"),
        (altered({**TURRET, "lower": [-4.0], "upper": [4.0]}, [0, None], "goal_lower"), "numbers"),
    ],
)
def test_half_a_limit_a_slide_on_a_circle_and_half_a_goal_are_refused(question, finding):
    with pytest.raises(RefusedError, match=finding):
        check(question, turned(2.9, 3.3, 3.18, 3.2))
    assert Question(TURRET).circles == {0, 1}
