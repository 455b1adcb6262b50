"""Plans on disk: nothing is lost, bytes are stable, wrong files are refused by key; table 1 as Markdown."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from coop_drake.answers import load_plan, save_plan, table_1
from coop_drake.answers.log import SimulationLog
from coop_drake.answers.speeds import SHORTEST, base_speeds, peak_speeds, steadiness
from coop_drake.errors import PlanError
from coop_drake.laws import ScheduledGains
from coop_drake.planning import make_plan
from coop_drake.plant import planning_problem
from coop_drake.simulation import simulate
from tests.support.cases import case
from tests.support.channels import bent_channel
from tests.support.mutants import put
from tests.support.small_loop import small_maps, small_problem
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


FAR = {"outer": [[90, 90], [91, 90], [91, 91]], "holes": []}


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (
            ("colour",),
            1,
            r"colour: 1 is not allowed; expected one of the keys problem, gain_set, joint_names",
        ),
        (("version",), True, r"version: True is not allowed; expected 6"),
        (("version",), 4, r"version: 4 is not allowed; expected 6"),
        (("goal_pose",), [0.0] * 4, r"goal_pose: .* is not allowed; expected 3 entries, not 4"),
        (("cells", 0, "lower", 1), 9.0, r"cells\[0\].upper\[1\]: .* more than cells\[0\].lower\[1\], 9"),
        (("cells", 1, "tidied"), FAR, r"transitions\[0\].target: .* inside cells\[1\].tidied"),
        (("transitions", 1, "path"), [[0.0, 0.0]], r"transitions\[1\].path: .* at least 2 points"),
        (("transitions", 0, "target"), [90.0, 90.0], r"transitions\[0\].target: .* cells\[0\].tidied"),
    ],
)
def test_wrong_files_are_refused_by_file_key_value_and_what_is_allowed(saved, place, value, message):
    saved.write_text(json.dumps(put(json.loads(saved.read_text()), place, value)))
    with pytest.raises(PlanError, match=r"plan\.json: .*" + message):
        load_plan(saved)


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


#

ROWS, ROBOTS, JOINTS = 5, 2, 3
SIZES = {"N": ROBOTS, "n": JOINTS, "1 + n": 1 + JOINTS, "3 + n": 3 + JOINTS}
ROW_SHAPES = {f.name: f.metadata["shape"][1:] for f in fields(SimulationLog) if "T" in f.metadata["shape"]}
SHAPES = {name: tuple(SIZES.get(size, size) for size in shape) for name, shape in ROW_SHAPES.items()}


@pytest.fixture
def log():
    generator = np.random.default_rng(7)
    arrays = {name: generator.normal(size=(ROWS, *shape)) for name, shape in SHAPES.items()}
    arrays["cell_index"] = np.arange(ROWS)
    return SimulationLog(
        **arrays,
        reached=True,
        violation="",
        joint_names=("a::one", "a::two", "b::one"),
        robot_names=("a", "b"),
        plan_digest="1f",
        scenario_digest="2e",
    )


def test_a_log_survives_its_file_bit_by_bit(log, tmp_path):
    path = tmp_path / "log.npz"
    log.save(path)
    again = SimulationLog.load(path)
    for name in SHAPES:
        np.testing.assert_array_equal(getattr(again, name), getattr(log, name))
    assert (again.reached, again.violation) == (True, "")
    assert again.joint_names == log.joint_names
    assert again.robot_names == log.robot_names
    assert (again.plan_digest, again.scenario_digest) == ("1f", "2e")


@pytest.mark.parametrize("lacking", ["times", "object_pose", "plan_digest"])
def test_a_file_that_lacks_an_array_is_no_log_and_names_it(log, tmp_path, lacking):
    path = tmp_path / "log.npz"
    log.save(path)
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files if name != lacking}
    np.savez(path, **arrays)
    with pytest.raises(PlanError, match=rf"log\.npz: not a simulation log; it lacks {lacking}; expected"):
        SimulationLog.load(path)


def test_a_violation_survives_its_file(log, tmp_path):
    path = tmp_path / "log.npz"
    replace(log, reached=False, violation="workspace clearance -0.01 m at t = 2 s").save(path)
    again = SimulationLog.load(path)
    assert again.reached is False
    assert again.violation == "workspace clearance -0.01 m at t = 2 s"


# Peaks of bases and joints are those of the log, beside the limits that are known.


@pytest.fixture(scope="module")
def run():
    scenario, plan = small_problem()
    return planning_problem(scenario), simulate(scenario, plan, small_maps())


def test_a_base_that_turns_at_a_constant_speed_has_that_speed(run):
    _, log = run
    angle = 2.0 * log.times + 3.0  # through half a turn, where the stated angle jumps
    poses = np.stack([0.3 * log.times, 0.4 * log.times, np.arctan2(np.sin(angle), np.cos(angle))], axis=-1)
    steady = replace(log, base_poses=np.repeat(poses[:, None], len(log.robot_names), axis=1))
    times, speeds = base_speeds(steady)
    np.testing.assert_allclose(speeds[..., 0], 0.5, rtol=1e-9)
    np.testing.assert_allclose(speeds[..., 1], 2.0, rtol=1e-9)
    assert np.diff(times).min() >= SHORTEST


def test_near_stops_and_slow_times_are_those_between_start_and_goal(run):
    """A speed of 1 - cos(2 pi t), 1 m/s in the mean: at rest at both ends and three times on the way."""
    _, log = run
    times = np.linspace(0.0, 4.0, len(log.times))
    speed = 1.0 - np.cos(2.0 * np.pi * times)
    poses = np.zeros((len(times), 3))
    poses[:, 0] = times - np.sin(2.0 * np.pi * times) / (2.0 * np.pi)
    twist = np.stack([speed, 0.0 * speed, 0.0 * speed], axis=-1)
    stops, slow = steadiness(replace(log, times=times, object_pose=poses, object_twist=twist))
    assert stops == 3
    assert slow == pytest.approx(4.0 * np.arccos(0.75) / np.pi, abs=0.03)


def test_every_base_and_joint_has_its_peak_and_limit(run):
    problem, log = run
    limits = replace(problem.limits, base_speeds=np.array([0.9, np.inf]), joint_rates=np.array([np.inf, 2.0]))
    peaks = {speed.name: speed for speed in peak_speeds(log, replace(problem, limits=limits))}
    assert list(peaks) == [
        "speed of robot_0", "turn rate of robot_0", "speed of robot_1", "turn rate of robot_1",
        "rate of robot_0::elbow", "rate of robot_1::elbow",
    ]  # fmt: skip
    assert (peaks["speed of robot_0"].limit, peaks["speed of robot_1"].limit) == (0.9, None)
    assert peaks["rate of robot_1::elbow"].peak == np.abs(log.joint_rates[:, 1]).max()
    assert [peaks[name].unit for name in ("speed of robot_0", "turn rate of robot_0")] == ["m/s", "rad/s"]
    lever = 1.2  # of the object's angle, at most
    fastest = np.hypot(*log.object_twist[:, :2].T).max() + lever * np.abs(log.object_twist[:, 2]).max()
    assert 0.3 < peaks["speed of robot_0"].peak < fastest + np.abs(log.joint_rates).max()
