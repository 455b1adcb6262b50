"""Plans on disk: nothing is lost, the bytes are stable, and wrong files are refused by key."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from coop_drake.answers import load_plan, save_plan
from coop_drake.errors import PlanError
from coop_drake.laws import ScheduledGains
from coop_drake.planning import make_plan
from tests.support.channels import bent_channel


@pytest.fixture(scope="module")
def plan():
    return make_plan(*bent_channel(cells=3), ScheduledGains(), gain_set_name="scheduled")


@pytest.fixture
def saved(plan, tmp_path):
    return save_plan(plan, tmp_path / "plan.json")


def assert_same(first, second):
    """Equal to the last bit, whatever is inside."""
    assert type(first) is type(second)
    if isinstance(first, Polygon):
        assert first.wkb == second.wkb
    elif isinstance(first, np.ndarray):
        np.testing.assert_array_equal(first, second)
        assert first.dtype == second.dtype
    elif isinstance(first, tuple):
        assert len(first) == len(second)
        for a, b in zip(first, second, strict=True):
            assert_same(a, b)
    elif hasattr(first, "__dataclass_fields__"):
        for field in fields(first):
            assert_same(getattr(first, field.name), getattr(second, field.name))
    else:
        assert first == second


def test_what_is_loaded_is_what_was_saved(plan, saved):
    assert_same(load_plan(saved), plan)


def test_saving_again_gives_the_same_bytes(plan, saved, tmp_path):
    again = save_plan(load_plan(saved), tmp_path / "again.json")
    assert again.read_bytes() == saved.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] != []
    assert not list(tmp_path.glob("*.part"))


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=0.0), st.floats(-3.0, 3.0))
@settings(max_examples=50)
def test_numbers_survive_to_the_last_bit(plan, tmp_path_factory, length, joint):
    path = tmp_path_factory.mktemp("plans") / "plan.json"
    moved = replace(plan.transitions[0], length=length)
    changed = replace(plan, transitions=(moved, *plan.transitions[1:]), goal_joints=(joint, None))
    assert_same(load_plan(save_plan(changed, path)), changed)


def test_holes_are_kept(plan, tmp_path):
    x0, y0, x1, y1 = plan.cells[1].tidied.buffer(1.0).bounds
    hall = box(x0, y0, x1, y1).difference(box(x0 + 0.1, y0 + 0.1, x0 + 0.2, y0 + 0.2))
    cells = (plan.cells[0], replace(plan.cells[1], tidied=hall), plan.cells[2])
    changed = replace(plan, cells=cells)
    loaded = load_plan(save_plan(changed, tmp_path / "plan.json"))
    assert len(loaded.cells[1].tidied.interiors) == 1
    assert_same(loaded, changed)


def drop(*way):
    def change(document):
        place = document
        for step in way[:-1]:
            place = place[step]
        del place[way[-1]]

    return change


def put(value, *way):
    def change(document):
        place = document
        for step in way[:-1]:
            place = place[step]
        place[way[-1]] = value

    return change


BOW = {"outer": [[0, 0], [1, 1], [1, 0], [0, 1]], "holes": []}
FAR = {"outer": [[90, 90], [91, 90], [91, 91]], "holes": []}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (drop("goal_pose"), r"goal_pose: None is not allowed; expected a value; this key is required"),
        (
            drop("cells", 1, "upper"),
            r"cells\[1\].upper: None is not allowed; expected a value; this key is required",
        ),
        (
            put(1, "colour"),
            r"colour: 1 is not allowed; expected one of the keys problem, gain_set, joint_names",
        ),
        (put("song", "format"), r"format: 'song' is not allowed; expected 'coop_drake plan'"),
        (put(1, "version"), r"version: 1 is not allowed; expected 4"),
        (put(True, "version"), r"version: True is not allowed"),
        (put(7, "gain_set"), r"gain_set: 7 is not allowed; expected a text"),
        (
            put(-0.1, "transitions", 0, "length"),
            r"transitions\[0\].length: -0.1 is not allowed; expected zero or a positive number",
        ),
        (put(float("nan"), "start", 2), r"start\[2\]: nan is not allowed; expected a finite number"),
        (put("a", "start", 0), r"start\[0\]: 'a' is not allowed"),
        (put([0.0, 1.0], "goal_pose"), r"goal_pose: .* is not allowed; expected 3 entries, not 2"),
        (put([0.0] * 4, "goal_pose"), r"goal_pose: .* is not allowed; expected 3 entries, not 4"),
        (put({}, "cells"), r"cells: \{\} is not allowed; expected a list"),
        (put([], "cells"), r"cells: \[\] is not allowed"),
        (put([0.0] * 2, "cells", 0, "lower"), r"cells\[0\].lower: .* expected 3 entries, not 2"),
        (
            put(9.0, "cells", 0, "lower", 1),
            r"cells\[0\].upper\[1\]: .* expected more than cells\[0\].lower\[1\], 9",
        ),
        (put(BOW, "cells", 2, "tidied"), r"cells\[2\].tidied: .* cross neither .*Self-intersection"),
        (
            put([[0, 0]], "cells", 2, "tidied", "outer"),
            r"cells\[2\].tidied.outer: .* a list of at least 3 corners",
        ),
        (
            put([0, 0, 0], "cells", 2, "tidied", "outer", 1),
            r"cells\[2\].tidied.outer\[1\]: .* expected a list of 2",
        ),
        (put(FAR, "cells", 1, "tidied"), r"transitions\[0\].target: .* inside cells\[1\].tidied"),
        (
            put([[0.0, 0.0]], "transitions", 1, "path"),
            r"transitions\[1\].path: .* expected a list of at least 2 points",
        ),
        (
            put([90.0, 90.0], "transitions", 0, "target"),
            r"transitions\[0\].target: .* inside cells\[0\].tidied",
        ),
        (put(-9.0, "transitions", 0, "goal_lower", 0), r"transitions\[0\].goal_lower.* axis 0: \[-9.0"),
        (drop("transitions", 2), r"transitions: .* expected 3 entries, not 2"),
        (
            put(0.0, "transitions", 0, "neck"),
            r"transitions\[0\].neck: 0.0 is not allowed; expected a positive number",
        ),
        (
            put(1, "transitions", 0, "only_angles"),
            r"transitions\[0\].only_angles: 1 is not allowed; expected true or false",
        ),
        (
            put("loose", "transitions", 0, "gains", "funnel"),
            r"transitions\[0\].gains.funnel: 'loose' .* one of exponential, quintic",
        ),
        (
            put([1, 1, -1], "transitions", 0, "gains", "decay_rate"),
            r"transitions\[0\].gains.decay_rate\[2\]: -1 is not allowed",
        ),
        (put([90.0, 90.0, 0, 0, 0], "start"), r"start: .* expected a configuration in cells\[0\]"),
        (put("other", "problem"), r"digest: .* the content is not what was written"),
        (put(3.0, "transitions", 0, "length"), r"digest: .* the content is not what was written"),
        (put("0" * 64, "digest"), r"digest: '0000"),
    ],
)
def test_wrong_files_are_refused_by_file_key_value_and_what_is_allowed(saved, change, message):
    document = json.loads(saved.read_text())
    change(document)
    saved.write_text(json.dumps(document))
    with pytest.raises(PlanError, match=r"plan\.json: " + message):
        load_plan(saved)


def test_files_that_are_no_json_or_not_there_are_refused(tmp_path):
    path = tmp_path / "plan.json"
    with pytest.raises(PlanError, match=r"plan\.json: cannot be read"):
        load_plan(path)
    path.write_text('{"format": ')
    with pytest.raises(PlanError, match=r"plan\.json: line 1: .* expected the JSON of a plan"):
        load_plan(path)
    path.write_text('{"format": 1, "format": 1}')
    with pytest.raises(PlanError, match=r"format: 1 is not allowed; expected each key at most once"):
        load_plan(path)
    path.write_text("[1, 2]")
    with pytest.raises(PlanError, match=r"document: .* expected a mapping"):
        load_plan(path)
