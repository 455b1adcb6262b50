"""Plans on disk: nothing is lost, bytes are stable, wrong files are refused by key; table 1 as Markdown."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from coop_drake.answers import load_plan, save_plan, table_1
from coop_drake.errors import PlanError
from coop_drake.laws import ScheduledGains
from coop_drake.planning import make_plan
from tests.support.cases import case
from tests.support.channels import bent_channel
from tests.support.mutants import put
from tests.support.synthetic_log import synthetic_plan


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


BOW = {"outer": [[0, 0], [1, 1], [1, 0], [0, 1]], "holes": []}
FAR = {"outer": [[90, 90], [91, 90], [91, 91]], "holes": []}


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (
            ("colour",),
            1,
            r"colour: 1 is not allowed; expected one of the keys problem, gain_set, joint_names",
        ),
        (("version",), True, r"version: True is not allowed; expected 4"),
        (("transitions", 0, "length"), -0.1, r"transitions\[0\].length: -0.1 .* zero or a positive number"),
        (("start", 2), float("nan"), r"start\[2\]: nan is not allowed; expected a finite number"),
        (("goal_pose",), [0.0] * 4, r"goal_pose: .* is not allowed; expected 3 entries, not 4"),
        (("cells", 0, "lower", 1), 9.0, r"cells\[0\].upper\[1\]: .* more than cells\[0\].lower\[1\], 9"),
        (("cells", 2, "tidied"), BOW, r"cells\[2\].tidied: .* cross neither .*Self-intersection"),
        (("cells", 1, "tidied"), FAR, r"transitions\[0\].target: .* inside cells\[1\].tidied"),
        (("transitions", 1, "path"), [[0.0, 0.0]], r"transitions\[1\].path: .* at least 2 points"),
        (("transitions", 0, "target"), [90.0, 90.0], r"transitions\[0\].target: .* cells\[0\].tidied"),
        (("transitions", 0, "goal_lower", 0), -9.0, r"transitions\[0\].goal_lower.* axis 0: \[-9.0"),
        (
            ("transitions", 0, "gains", "funnel"),
            "loose",
            r"\[0\].gains.funnel: .* exponential, quintic",
        ),
        (("start",), [90.0, 90.0, 0, 0, 0], r"start: .* expected a configuration in cells\[0\]"),
        (("problem",), "other", r"digest: .* the content is not what was written"),
        (("digest",), "0" * 64, r"digest: '0000"),
    ],
)
def test_wrong_files_are_refused_by_file_key_value_and_what_is_allowed(saved, place, value, message):
    saved.write_text(json.dumps(put(json.loads(saved.read_text()), place, value)))
    with pytest.raises(PlanError, match=r"plan\.json: .*" + message):
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


def test_every_cell_has_a_row_with_the_bounds_of_every_axis():
    plan = synthetic_plan(case("base"))
    rows = [line for line in table_1(plan).splitlines() if line.startswith("|")]
    cells = [[entry.strip() for entry in row.strip("|").split("|")] for row in rows]
    assert cells[0][:3] == ["cell", "theta lower", "theta upper"]
    assert cells[0][3:] == [f"{name} {bound}" for name in plan.joint_names for bound in ("lower", "upper")]
    assert len(cells) == 2 + len(plan.cells)
    first = [f"{value:.3f}" for k in range(3) for value in (plan.cells[0].lower[k], plan.cells[0].upper[k])]
    assert cells[2] == ["1", *first]
    assert {len(row) for row in cells} == {7}
