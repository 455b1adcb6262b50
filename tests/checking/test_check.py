"""The exact checker: what it accepts and refuses, and what lies at its boundaries."""

import json
import re
import resource
import subprocess
import sys
from copy import deepcopy
from math import pi
from pathlib import Path

import numpy as np
import pytest

from coop_drake import checking
from coop_drake.checking import RefusedError, check

ROOT = Path(__file__).parents[2]
QUESTION, PROOF = map(
    json.loads,
    re.findall(
        r"```json\n(.*?)```", (ROOT / "docs" / "certificates.md").read_text(encoding="utf-8"), re.DOTALL
    ),
)


def altered(document, value, *way):
    document = deepcopy(document)
    place = document
    for step in way[:-1]:
        place = place[step]
    place[way[-1]] = value
    return document


def rectangle(x0, y0, x1, y1):
    return {"outer": [[x0, y0], [x1, y0], [x1, y1], [x0, y1]], "holes": []}


def refused(question, answer):
    with pytest.raises(RefusedError) as caught:
        check(question, answer)
    return str(caught.value)


def test_the_proof_on_paper_holds_with_all_the_edges_that_paper_lists():
    counts = dict(check(QUESTION, PROOF))
    assert [count for name, count in counts.items() if name.startswith("edges")] == [48]


def test_steps_are_allowed_for_each_slice(monkeypatch):
    monkeypatch.setattr(checking, "STEPS", 0)
    check(QUESTION, PROOF)
    monkeypatch.setattr(checking, "STEPS_EACH", 10**3)
    assert "more steps are needed than are allowed" in refused(QUESTION, PROOF)


CELL = ("slices", 0, "cells", 0, "polygon")


@pytest.mark.parametrize(
    ("answer", "finding"),
    [
        (altered(PROOF, rectangle(0.3, 0.2, 3.8, 1.8), *CELL), "no cell covers"),
        (altered(PROOF, rectangle(0.2, 0.2, 3.69, 1.8), *CELL), "no cell covers"),
        (altered(PROOF, rectangle(0.2, 0.2, 5.2, 1.8), *CELL), "touches"),
        (altered(PROOF, False, "slices", 0, "cells", 0, "reached"), "cells may hold the start"),
        (altered(PROOF, True, "slices", 0, "cells", 1, "reached"), "cells may hold the goal"),
        (altered(PROOF, [], "slices", 0, "cells"), "no cell covers"),
        (altered(PROOF, [], "slices", 0, "witnesses"), "no cell covers"),
        (altered(PROOF, [3.1], "slices", 0, "upper"), "whole turn"),
        (altered(PROOF, [], "slices"), "slices: are not about a whole turn"),
        (
            altered(PROOF, [[-0.36, -0.36], [0.36, -0.36], [0, 0.3]], "slices", 0, "witnesses", 0, "polygon"),
            "leave",
        ),
        (
            altered(PROOF, [0, 0], "slices", 0, "witnesses", 0, "pieces"),
            "neither one piece nor a pair",
        ),
    ],
)
def test_what_does_not_hold_is_refused(answer, finding):
    assert finding in refused(QUESTION, answer)


@pytest.mark.parametrize("gap", [1e-6, 1e-9, 1e-12, 1e-15])
def test_two_cells_with_a_gap_of_a_hair_between_them_do_not_cover_it(gap):
    """A cut through a way that is free, with cells on either side that do not touch."""
    wide = altered(QUESTION, [], "floor", "holes")
    cells = [
        {"reached": True, "polygon": rectangle(0.2, 0.2, 4.0, 1.8)},
        {"reached": False, "polygon": rectangle(4.0 + gap, 0.2, 7.8, 1.8)},
    ]
    assert "no cell covers" in refused(wide, altered(PROOF, cells, "slices", 0, "cells"))


def test_a_pillar_as_thin_as_a_hair_blocks_and_a_gap_of_the_disc_does_not():
    thin = altered(QUESTION, [[[4, 0.5], [4 + 1e-12, 0.5], [4 + 1e-12, 1.5], [4, 1.5]]], "floor", "holes")
    cells = [
        {"reached": True, "polygon": rectangle(0.2, 0.2, 3.8, 1.8)},
        {"reached": False, "polygon": rectangle(4.2, 0.2, 7.8, 1.8)},
    ]
    assert check(thin, altered(PROOF, cells, "slices", 0, "cells"))
    low = altered(QUESTION, [[[4, 1.01], [5, 1.01], [5, 1.5], [4, 1.5]]], "floor", "holes")
    assert "no cell covers" in refused(low, PROOF)


@pytest.mark.parametrize(
    ("goal", "room", "held"),
    [
        ([3.81, 1], 0.01, True),
        ([3.81, 1], 0.01 + 1e-15, False),
        ([3.9, 1.9], 0.14, True),
        ([3.9, 1.9], 0.15, False),
    ],
)
def test_a_no_covers_all_positions_of_the_goal(goal, room, held):
    """The reached cell ends at x = 3.8 and y = 1.8, of which the doubles are a little less."""
    question = QUESTION | {"goal": goal, "tolerances": [room, 0.02]}
    if held:
        assert check(question, PROOF)
    else:
        assert "cells may hold the goal and have reached: True" in refused(question, PROOF)


@pytest.mark.parametrize(
    ("angle", "room", "held"),
    [(pi - 0.3, 0.05, True), (pi - 0.3, 0.2, False), (3 * pi - 0.3, 0.2, False), (-3 * pi - 0.3, 0.2, False)],
)
def test_a_no_covers_all_angles_of_the_goal_modulo_a_turn(angle, room, held):
    """The middle of the disc is half a metre from the origin of the object."""
    question = QUESTION | {"start": [0.5, 1, 0], "goal": [4.29, 1], "tolerances": [0.001, room]}
    question |= {"goal_lower": [angle], "goal_upper": [angle]}
    question = altered(question, [[0.5, 0]], "pieces", 0, "corners")
    proof = PROOF | {"point": [0.5, 0]}
    if held:
        assert check(question, proof)
    else:
        assert "cells may hold the goal and have reached: True" in refused(question, proof)


TEAM = {
    **QUESTION,
    "floor": rectangle(0, 0, 8, 8),
    "lower": [-1.0], "upper": [1.0],
    "components": [
        {"parent": 0, "joint": 0, "sign": 0, "angle": 0, "slide": [1, 0], "offset": [0.5, 0]},
    ],
    "pieces": [
        {"body": "object", "component": 0, "corners": [[0, 0]], "radius": 0.3},
        {"body": "base", "component": 1, "corners": [[0, 0]], "radius": 0.2},
    ],
    "start": [2, 4, 0, 0.5], "goal": [3, 4], "goal_lower": [6.283185307179586, 0.5],
    "goal_upper": [6.283185307179586, 0.5], "tolerances": [0.01, 0.02, 0.02],
}  # fmt: skip


def plan(lower=0.2, upper=0.6):
    path = [[2, 4], [3, 4]]
    return {
        "format": "coop_drake plan", "version": 6,
        "cells": [{"lower": [-0.1, lower], "upper": [0.1, upper], "tidied": rectangle(1.5, 3.5, 4, 4.5)}],
        "transitions": [{
            "target": [3, 4], "goal_lower": [-0.01, 0.49], "goal_upper": [0.01, 0.51], "path": path,
            "neck": 0.5, "length": 1.0, "inradius": 0.01,
        }],
    }  # fmt: skip


def test_a_plan_with_a_prismatic_joint_holds_and_its_goal_is_met_modulo_a_turn():
    assert check(TEAM, plan())
    assert "object may touch base" in refused(TEAM, plan(lower=-0.01))
    assert "limits" in refused(TEAM, plan(upper=1.01))
    aside = altered(TEAM, [[0, 1, "joint"]], "left_aside")
    assert check(aside, plan(lower=-0.01))


@pytest.mark.parametrize(
    ("value", "way", "finding"),
    [
        (0.6, ("neck",), "neck"),
        (1.1, ("length",), "length"),
        (0.011, ("inradius",), "within the tolerance"),
        ([[2, 4], [2.5, 5], [3, 4]], ("path",), "neck"),
        ([[2, 4]], ("path",), "path"),
        ([3, 4.001], ("target",), "path"),
        ([0.01, 0.49 + 1e-12], ("goal_upper",), "upper"),
        ([0.01, 0.53], ("goal_upper",), "leaves a cell or the tolerance"),
        ([0.03, 0.51], ("goal_upper",), "leaves a cell or the tolerance"),
    ],
)
def test_figures_of_a_plan_that_are_not_true_are_refused(value, way, finding):
    assert finding in refused(TEAM, altered(plan(), value, "transitions", 0, *way))


@pytest.mark.parametrize(("target", "inradius", "held"), [(3.004, 0.005, True), (3.006, 0.005, False)])
def test_a_plan_ends_within_the_goal_and_not_always_in_its_middle(target, inradius, held):
    answer = plan()
    answer["transitions"][0] |= {
        "target": [target, 4], "path": [[2, 4], [target, 4]], "length": target - 2, "inradius": inradius,
    }  # fmt: skip
    if held:
        assert check(TEAM, answer)
    else:
        assert "does not end within the tolerance" in refused(TEAM, answer)


def test_joints_of_the_goal_are_within_their_limits():
    """Of 0.99 to 1.01 the limits leave 0.99 to 1, of 1.01 to 1.03 nothing."""
    question = TEAM | {"goal_lower": [0, 1.0], "goal_upper": [0, 1.0], "tolerances": [0.01, 0.02, 0.01]}
    answer = plan(upper=1.0)
    answer["transitions"][0] |= {"goal_lower": [-0.01, 0.991], "goal_upper": [0.01, 1.0]}
    assert check(question, answer)
    answer = altered(answer, [0.01, 1.0 + 1e-8], "transitions", 0, "goal_upper")
    assert "leaves a cell" in refused(question, answer)
    beyond = question | {"goal_lower": [0, 1.02], "goal_upper": [0, 1.02]}
    assert "leaves a cell or the tolerance" in refused(beyond, answer)


def test_a_cell_that_reaches_to_a_wall_or_beyond_is_refused():
    for x in (0.29, -3.0):
        assert "wall" in refused(TEAM, altered(plan(), rectangle(x, 3.5, 4, 4.5), "cells", 0, "tidied"))


def test_a_slice_is_blocked_where_two_pieces_overlap_in_all_of_it():
    question = altered(TEAM, [-0.6], "lower") | {"upper": [-0.4], "start": [2, 4, 0, -0.5]}
    question |= {"goal_lower": [0, -0.6], "goal_upper": [0, -0.4]}
    overlap = {"pieces": [0, 1], "component": 0, "polygon": [[0.0, 0.0]]}
    whole = {"lower": [-pi, -0.6], "upper": [pi, -0.4], "witnesses": [overlap], "cells": []}
    blocked = {**PROOF, "slices": [whole]}
    assert check(question, blocked)
    far = altered(blocked, [[0.25, 0.0]], "slices", 0, "witnesses", 0, "polygon")
    assert "may leave the inside" in refused(question, far)
    assert "neither one piece nor a pair" in refused(
        altered(question, [[0, 1, "joint"]], "left_aside"), blocked
    )
    short = altered(blocked, [pi, -0.5], "slices", 0, "upper")
    assert "do not tile" in refused(question, short)


def test_tolerances_are_not_negative():
    assert "question.tolerances: are negative" in refused(QUESTION | {"tolerances": [-0.01, 0.02]}, PROOF)


def test_it_runs_in_an_empty_python_on_two_files(tmp_path):
    (tmp_path / "question.json").write_text(json.dumps(QUESTION))
    (tmp_path / "answer.json").write_text(json.dumps(PROOF))
    (tmp_path / "deep.json").write_text("[" * 100_000)
    start = f"import runpy, sys; sys.path.insert(0, {str(ROOT)!r}); sys.argv[1:] = "
    run = "; runpy.run_module('coop_drake.checking', run_name='__main__')"
    for files, code in ((["question.json", "answer.json"], 0), (["answer.json"], 2), (["deep.json"], 2)):
        paths = [str(tmp_path / name) for name in files]
        done = subprocess.run(
            [sys.executable, "-I", "-S", "-c", f"{start}{paths}{run}"],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == code, done.stderr
        assert "Traceback" not in done.stderr


# Questions at the edge of what can be written down: decided rightly, or refused with a reason, in bounds.


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
