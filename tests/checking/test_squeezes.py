"""Two discs that walls squeeze together cannot change their order in a corridor; forgeries are refused."""

import json
from copy import deepcopy
from math import cos, hypot, pi, sin

import numpy as np
import pytest

from coop_drake.checking import RefusedError, check

LENGTH, RADIUS, HALF = 20.0, 0.3, 0.2
SHORTEST, LONGEST = 0.5, 0.7


def rectangle(x0, y0, x1, y1):
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


QUESTION = {
    "format": "coop_drake question", "version": 3,
    "floor": {"outer": rectangle(0, 0, LENGTH, 1), "holes": []},
    "lower": [SHORTEST], "upper": [LONGEST],
    "components": [{"parent": 0, "joint": 0, "sign": 0, "angle": 0, "slide": [1, 0], "offset": [0, 0]}],
    "pieces": [
        {"body": "first", "component": 0, "corners": [[0, 0]], "radius": RADIUS},
        {"body": "second", "component": 1, "corners": [[0, 0]], "radius": RADIUS},
    ],
    "left_aside": [], "start": [10, 0.5, 0, 0.65], "goal": [10, 0.5],
    "goal_lower": [pi, SHORTEST], "goal_upper": [pi, LONGEST], "tolerances": [0.01, 0.02, 0.02],
}  # fmt: skip
"""The second disc is 0.5 m to 0.7 m away from the first one, in the object's direction x."""


def witness(piece, x, y, half):
    return {"pieces": [piece], "component": 0, "polygon": rectangle(x - half, y - half, x + half, y + half)}


def cut(piece, side):
    """A disc touches the wall above it at y of 0.75 m or more, the wall below it at 0.25 m or less."""
    return {"piece": piece, "direction": [0, side], "limit": 0.75 if side > 0 else -0.25}


def across(middle, side):
    """A slice in which the second disc is above the first one (side 1) or below it (side -1)."""
    low, high = sorted((0.5 + side * end) for end in (-0.4, -0.05))
    squeeze = {
        "pieces": [0, 1], "component": 0, "polygon": rectangle(0.1, low, LENGTH - 0.1, high),
        "cuts": [cut(0, -side), cut(1, side)],
    }  # fmt: skip
    seen = [witness(0, 0, 0, 0.2), witness(1, 0, side * 0.6, 0.05)]
    ends = {"lower": [middle - HALF, SHORTEST], "upper": [middle + HALF, LONGEST]}
    return {**ends, "witnesses": seen, "cells": [], "squeezes": [squeeze]}


def along(low, high, *, reached):
    everything = {"reached": reached, "polygon": {"outer": rectangle(-90, -90, 90, 90), "holes": []}}
    ends = {"lower": [low, SHORTEST], "upper": [high, LONGEST]}
    return {**ends, "witnesses": [witness(0, 0, 0, 0.2)], "cells": [everything]}


QUARTER = pi / 2
PROOF = {
    "format": "coop_drake proof of infeasibility", "version": 4, "component": 0, "point": [0, 0],
    "slices": [
        along(HALF - QUARTER, QUARTER - HALF, reached=True),
        across(QUARTER, 1),
        along(QUARTER + HALF, 3 * QUARTER - HALF, reached=False),
        across(3 * QUARTER, -1),
    ],
}  # fmt: skip
for before, after in zip(PROOF["slices"], PROOF["slices"][1:], strict=False):
    after["lower"][0] = before["upper"][0]


def altered(value, *way):
    document = deepcopy(PROOF)
    place = document["slices"][1]["squeezes"][0]
    for step in way[:-1]:
        place = place[step]
    place[way[-1]] = value
    return document


def refusal(answer, question=QUESTION):
    try:
        check(question, answer)
    except RefusedError as error:
        return str(error)
    return None


def test_two_discs_cannot_change_their_order_in_a_corridor():
    counts = dict(check(QUESTION, PROOF))
    assert counts["pieces are squeezed in all of a slice"] == 2
    without = deepcopy(PROOF)
    del without["slices"][1]["squeezes"]
    assert "slices[1]: no cell covers" in refusal(without)


@pytest.mark.parametrize(
    ("value", "way", "finding"),
    [
        (-0.31, ("cuts", 0, "limit"), "may leave first clear of the walls"),
        (0.69, ("cuts", 1, "limit"), "may leave second clear of the walls"),
        (0.0, ("cuts", 0, "limit"), "may leave room between first and second"),
        (1.0, ("cuts", 1, "limit"), "may leave room between first and second"),
        ([0.0, 1.0], ("cuts", 0, "direction"), "may leave first clear of the walls"),
        ([1.0, 0.0], ("cuts", 1, "direction"), "may leave second clear of the walls"),
        ([0.0, 0.0], ("cuts", 0, "direction"), "may leave first clear of the walls"),
        ([], ("cuts",), "may leave room between first and second"),
        (1, ("cuts", 0, "piece"), "may leave room between first and second"),
        (2, ("cuts", 0, "piece"), "index: 2 is none below 2"),
        ([0.0], ("cuts", 0, "direction"), "are not 3 between"),
        (rectangle(0.1, 0.1, 19.9, 0.9), ("polygon",), "may leave second clear of the walls"),
        (rectangle(0.1, 0.21, 19.9, 0.3), ("polygon",), "no cell covers"),
        (rectangle(0.1, -0.4, 19.9, 0.45), ("polygon",), "may leave first clear of the walls"),
        ([1, 0], ("pieces",), "no pair of round pieces"),
        ([0, 0], ("pieces",), "no pair of round pieces"),
        ([0, 2], ("pieces",), "index: 2 is none below 2"),
        ([0], ("pieces",), "no pair of round pieces"),
        (2, ("component",), "index: 2 is none below 2"),
        ([], ("polygon",), "are none"),
    ],
)
def test_forged_squeezes_are_refused(value, way, finding):
    assert finding in refusal(altered(value, *way))


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        ("floor", {"outer": rectangle(0, 0, LENGTH, 1.21), "holes": []}),
        ("upper", [0.95]),
        ("left_aside", [[0, 1, "model"]]),
    ],
)
def test_a_squeeze_does_not_hold_for_another_question(entry, value):
    assert refusal(PROOF, {**QUESTION, entry: value}) is not None


def test_a_squeeze_may_be_about_a_joints_component():
    """The place and the direction of the second disc's frame follow from the angle as the first one's do."""
    turned = altered(1, "component")
    assert refusal(turned) is None


def test_in_squeezes_that_are_accepted_no_configuration_is_free():
    random, accepted = np.random.default_rng(1), 0
    for _ in range(120):
        squeeze = deepcopy(PROOF["slices"][1]["squeezes"][0])
        for one in squeeze["cuts"]:
            one["limit"] += random.normal(0, 0.05)
            one["direction"] = (np.array(one["direction"]) + random.normal(0, 1e-3, 2)).tolist()
        squeeze["polygon"] = (np.array(squeeze["polygon"]) + random.normal(0, 0.02, (4, 2))).tolist()
        document = deepcopy(PROOF)
        document["slices"][1]["squeezes"].append(squeeze)
        if refusal(json.loads(json.dumps(document))) is None:
            accepted += 1
            assert not any(map(free, configurations(squeeze["polygon"], random, 300)))
    assert 10 < accepted < 110


def configurations(polygon, random, count):
    """Positions in a polygon, angles and joint values of the slice, half of them near the walls' limits."""
    shares = random.dirichlet(np.full(len(polygon), 0.5), count)
    angles = QUARTER + random.uniform(-HALF, HALF, count)
    return zip(shares @ np.array(polygon), angles, random.uniform(SHORTEST, LONGEST, count), strict=True)


def free(configuration):
    (x, y), angle, value = configuration
    places = [(x, y), (x + value * cos(angle), y + value * sin(angle))]
    inside = all(RADIUS <= v <= 1 - RADIUS and RADIUS <= u <= LENGTH - RADIUS for u, v in places)
    return inside and hypot(value * cos(angle), value * sin(angle)) >= 2 * RADIUS


def test_a_polygon_that_was_shown_for_one_slice_is_not_taken_for_another():
    document = deepcopy(PROOF)
    document["slices"][3]["witnesses"][1] = document["slices"][1]["witnesses"][1]
    assert "slices[3].witnesses: may leave the inside of second" in refusal(document)
