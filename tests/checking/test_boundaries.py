"""Questions at the edge of what can be written down: decided rightly, or refused with a reason, in bounds."""

import json
import resource
import subprocess
import sys
from copy import deepcopy
from math import pi

import numpy as np
import pytest

from coop_drake.checking import check
from tests.checking.test_check import PROOF, QUESTION, ROOT, TEAM, altered, plan, rectangle, refused


def assert_decided(question, answer, free):
    if free:
        assert check(question, answer)
    else:
        assert "may touch a wall" in refused(question, answer)


def mapped(question, answer, scale=1.0, shift=(0.0, 0.0)):
    """The question and a plan or proof of it in another unit of length, with the origin elsewhere."""
    question, answer = deepcopy(question), deepcopy(answer)

    def place(points):
        points[:] = (scale * np.array(points) + shift).tolist()

    def stretch(holder, key):
        holder[key] = (scale * np.array(holder[key], dtype=float)).tolist()

    def region(value):
        for ring in (value["outer"], *value["holes"]):
            place(ring)

    region(question["floor"])
    (start,), (goal,) = [question["start"][:2]], [question["goal"]]
    place(start), place(goal)
    question["start"][:2], question["goal"] = start, goal
    question["tolerances"][0] *= scale
    for piece in question["pieces"]:
        stretch(piece, "corners"), stretch(piece, "radius")
    for joint in question["components"]:  # Slides are in the unit, too: their values stay, directions grow.
        stretch(joint, "offset"), stretch(joint, "slide")
    for cell in answer.get("cells", ()):
        region(cell["tidied"])
    for step in answer.get("transitions", ()):
        place(step["path"])
        step["target"] = step["path"][-1]
        for key in ("inradius", "neck", "length"):
            step[key] *= scale * (1.0 - 1e-9 if key != "length" else 1.0)
    for part in answer.get("slices", ()):
        for witness in part["witnesses"]:
            stretch(witness, "polygon")
        for cell in part["cells"]:
            region(cell["polygon"])
    return question, answer


@pytest.mark.parametrize("scale", [1e-3, 1e-2, 30.0, 1e3])
@pytest.mark.parametrize(("question", "answer"), [(QUESTION, PROOF), (TEAM, plan())], ids=["proof", "plan"])
def test_the_unit_of_length_does_not_matter(question, answer, scale):
    assert check(*mapped(question, answer, scale=scale))


@pytest.mark.parametrize(("question", "answer"), [(QUESTION, PROOF), (TEAM, plan())], ids=["proof", "plan"])
def test_an_origin_a_thousand_kilometres_away_does_not_matter_and_a_farther_one_is_refused(question, answer):
    near, own = mapped(question, answer, shift=(1e6, -1e6))
    if "transitions" in own:  # Coordinates are rounded there, to 10^-10 m.
        own["transitions"][0].update(length=1.0, neck=0.49, inradius=0.0099)
    assert check(near, own)
    assert "2^20" in refused(*mapped(question, answer, shift=(1.1e6, 0.0)))


@pytest.mark.parametrize("turns", [-100, -1, 1, 100])
def test_angles_may_lie_any_number_of_turns_away(turns):
    """To a unit in the last place of the angle: slices begin anywhere, a goal is met modulo a turn."""
    lower = -0.7 + 2.0 * pi * turns
    moved = altered(PROOF, [lower], "slices", 0, "lower")
    assert check(QUESTION, altered(moved, [lower + 2.0 * pi], "slices", 0, "upper"))
    goal = 2.0 * pi * turns
    asked = altered(TEAM, [goal, 0.5], "goal_lower")
    assert check(altered(asked, [goal, 0.5], "goal_upper"), plan())
    off = altered(TEAM, [goal + 0.5, 0.5], "goal_lower")
    assert "tolerance" in refused(altered(off, [goal + 0.5, 0.5], "goal_upper"), plan())


def test_a_plan_leads_across_the_end_of_a_turn():
    asked = altered(TEAM, [2.0, 4.0, pi - 0.05, 0.5], "start")
    for end in ("goal_lower", "goal_upper"):
        asked = altered(asked, [0.05 - pi, 0.5], end)
    found = plan()
    found["cells"][0].update(lower=[pi - 0.1, 0.2], upper=[pi + 0.1, 0.6])
    found["transitions"][0].update(goal_lower=[pi + 0.04, 0.49], goal_upper=[pi + 0.06, 0.51])
    assert check(asked, found)
    found["transitions"][0].update(goal_lower=[pi - 0.06, 0.49], goal_upper=[pi - 0.04, 0.51])
    assert "tolerance" in refused(asked, found)


def test_a_joint_at_its_limit_is_allowed_and_beyond_is_not():
    asked = altered(TEAM, [2.0, 4.0, 0.0, 1.0], "start")
    for end in ("goal_lower", "goal_upper"):
        asked = altered(asked, [0.0, 1.0], end)
    found = plan(lower=0.9, upper=1.0)
    found["transitions"][0].update(goal_lower=[-0.01, 0.99], goal_upper=[0.01, 1.0])
    assert check(asked, found)
    over = float(np.nextafter(1.0, 2.0))
    assert "limits" in refused(asked, altered(found, [0.1, over], "cells", 0, "upper"))
    assert "limits" in refused(altered(asked, over, "start", 3), found)


@pytest.mark.parametrize("width", [0.0, 1e-12, 1e-9, 1e-6])
def test_a_wall_as_thin_as_a_hair_is_a_wall(width):
    """In the way it is met; a nanometre out of the reach of an arc it is not; as a slit of no width, too."""
    found = plan()
    found["cells"][0].update(lower=[-6e-10, 0.2], upper=[6e-10, 0.6])
    found["transitions"][0].update(goal_lower=[-5e-10, 0.49], goal_upper=[5e-10, 0.51])
    reached = 4.0 + 0.5 + 0.6 + 0.2
    for x, free in ((3.0, False), (reached - 1e-9, False), (reached + 1e-9, True)):
        hair = [[x, 3.0], [x + width, 3.0], [x + width, 5.0], [x, 5.0]]
        assert_decided(altered(TEAM, [hair], "floor", "holes"), found, free)


@pytest.mark.parametrize(
    "ring",
    [
        [[0, 0], [8, 0], [8, 8], [0, 8], [0, 7], [0.2, 6.8], [0, 6.6], [0.2, 7], [0, 7]],
        [[0, 0], [8, 0], [8, 8], [4, 8], [4, 7], [4, 8], [0, 8]],
        [[0, 0], [8, 0], [8, 8], [0, 8], [0, 0], [8, 0], [8, 8], [0, 8], [0, 0], [8, 0], [8, 8], [0, 8]],
        [[0, 0], [0, 0], [8, 0], [8, 0], [8, 8], [8, 8], [0, 8]],
        [[0, 0], [8, 0], [8, 8], [7, 9], [9, 9], [8, 8], [0, 8]],
    ],
    ids=["crosses itself", "edge there and back", "thrice around", "corners twice", "figure eight"],
)
def test_rings_that_touch_themselves_have_the_points_of_odd_parity(ring):
    asked = altered(TEAM, ring, "floor", "outer")
    assert check(asked, plan())
    across = [*ring, [0, 4], [8, 4], [0, 4]]
    assert "may touch a wall" in refused(altered(asked, across, "floor", "outer"), plan())
    twice = ring * 2
    assert "outside the floor" in refused(altered(asked, twice, "floor", "outer"), plan())


def test_arcs_are_what_they_are_and_not_polygons():
    """A disc, and a capsule that turns, a nanometre away from a wall, touching it, and beyond it."""
    for body, reach in (([[0, 0]], 0.25), ([[-0.25, 0], [0.25, 0]], 0.5)):
        asked = altered(TEAM, body, "pieces", 0, "corners")
        asked = altered(asked, 0.25, "pieces", 0, "radius")
        asked["components"][0]["offset"] = [2.0, 0.0]
        for gap, free in ((1e-9, True), (0.0, False), (-1e-9, False)):
            asked["floor"] = rectangle(1.5 - reach - gap, 0, 9, 8)
            assert_decided(asked, plan(), free)


def circle(count, radius, x=0.0, y=0.0):
    angles = np.arange(count) * (2.0 * pi / count)
    return np.column_stack((x + radius * np.cos(angles), y + radius * np.sin(angles))).tolist()


def with_pieces(count, corners):
    """Pieces of the object and of the base, equally many, of so many corners, in each other's way."""
    asked = deepcopy(TEAM)
    rounded = [
        {**piece, "corners": circle(corners, piece["radius"]), "radius": 0.0} for piece in TEAM["pieces"]
    ]
    asked["pieces"] = [rounded[k % 2] for k in range(count)]
    asked["components"][0]["offset"] = [0.1, 0.0]
    return asked


def with_chain(count):
    """A chain of joints, each on the one before."""
    asked, joint = deepcopy(TEAM), {**TEAM["components"][0], "slide": [0, 0], "offset": [1e-4, 0], "sign": 1}
    asked["components"] += [{**joint, "parent": k + 1} for k in range(count)]
    asked["pieces"].append({**TEAM["pieces"][0], "component": count + 1})
    return asked


LARGE = {
    "bodies of thousands of corners": lambda: with_pieces(2, 3000),
    "thousands of bodies": lambda: with_pieces(20_000, 3),
    "chain of thousands of joints": lambda: with_chain(20_000),
}
"""Questions that are small documents and much work."""

BOUNDS = ((resource.RLIMIT_AS, 10**9), (resource.RLIMIT_CPU, 60))
"""A gigabyte, a minute of processor time."""


@pytest.mark.slow
@pytest.mark.parametrize("make", LARGE.values(), ids=LARGE)
def test_large_documents_are_decided_or_refused_within_a_minute_and_a_gigabyte(make, tmp_path):
    paths = [tmp_path / "question.json", tmp_path / "answer.json"]
    for path, document in zip(paths, (make(), plan()), strict=True):
        path.write_text(json.dumps(document))
    done = subprocess.run(
        [sys.executable, "-m", "coop_drake.checking", *map(str, paths)],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        preexec_fn=lambda: [resource.setrlimit(which, (most, most)) for which, most in BOUNDS],
    )
    assert done.returncode == 1, done.stderr
    assert done.stdout.startswith("refused: ")


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize("way", [("floor", "outer"), ("pieces", 0, "corners")], ids=str)
def test_a_million_corners_are_called_too_much_work(way):
    assert "more steps are needed" in refused(altered(TEAM, [[0, 0], [8, 0], [8, 8]] * 333_334, *way), plan())


@pytest.mark.parametrize("depth", [100, 900, 5000])
def test_deep_nesting_is_refused(depth):
    deep = []
    for _ in range(depth):
        deep = [deep]
    for way in (("cells",), ("cells", 0, "lower"), ("transitions", 0, "target"), ("transitions", 0, "path")):
        assert refused(TEAM, altered(plan(), deep, *way))
    for way in (("pieces",), ("pieces", 0, "corners"), ("start",), ("floor", "outer"), ("left_aside",)):
        assert refused(altered(TEAM, deep, *way), plan())
