"""The recording is one small page that needs nothing else and shows what the log holds."""

import dataclasses
import re

import numpy as np
import pytest
from pydrake.geometry import Rgba

from coop_drake.errors import CoopDrakeError
from coop_drake.scenario import load_scenario
from coop_drake.viz import inline_frame, recording_html, write_recording
from coop_drake.viz.recording import kept_frames, page_content, with_overlay
from tests.support.cases import case
from tests.support.recorded import paths, played, track
from tests.support.scenarios import MODELS
from tests.support.synthetic_log import synthetic_log, synthetic_plan

FRAMES = np.linspace(0.0, 1.0, 400)


def between(values, kept):
    frames = np.arange(len(values))
    return np.column_stack([np.interp(frames, kept, column[kept]) for column in values.T])


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3])
def test_straight_lines_between_kept_frames_meet_all_frames(tolerance):
    values = np.column_stack(
        [np.sin(20.0 * FRAMES), np.abs(FRAMES - 0.4), np.random.default_rng(1).random(400)]
    )
    kept = kept_frames(values, tolerance, longest=400)
    assert np.abs(between(values, kept) - values).max() <= tolerance


@pytest.mark.parametrize(
    ("values", "tolerance", "longest", "kept"),
    [
        (FRAMES[:, None], 1e-9, 400, [0, 399]),
        (np.where(FRAMES > 0.5, 1.0, 0.0)[:, None], 0.01, 400, [0, 199, 200, 399]),
        (np.zeros((100, 1)), 1.0, 30, [0, 30, 60, 90, 99]),
        (np.zeros((1, 3)), 1.0, 5, [0]),
    ],
    ids=["straight line", "jump", "no two further apart than allowed", "one frame"],
)
def test_kept_frames_by_hand(values, tolerance, longest, kept):
    assert kept_frames(values, tolerance, longest=longest) == kept


OBJECT = "/team/illustration/object/body"


@pytest.fixture(scope="module")
def text(page):
    return page.read_text()


def test_the_page_needs_no_network(text):
    assert not re.search(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?!data:)', text)
    assert not re.search(r"\b(?:fetch|import|open|WebSocket)\([\"'`](?:https?|wss?):", text)


def test_floor_walls_team_grasps_plan_trail_and_forces_are_in_the_scene(text):
    shown = paths(text)
    assert shown >= {"/stage/floor", "/stage/walls", "/stage/pillars/00", "/motion/trail"}
    assert shown >= {
        f"{OBJECT}/grasps/robot_0",
        f"{OBJECT}/grasps/robot_1",
        f"{OBJECT}/object/visual",
        f"{OBJECT}/shadow",
    }
    assert shown >= {f"/team/illustration/robot_1/base/robot_1/wheel_{k}" for k in range(3)}
    assert shown >= {"/forces/robot_0/shaft", "/forces/robot_1/head", "/plan/goal_pose/area"}
    for index in range(5):
        assert shown >= {f"/plan/cells/{index:03d}/area", f"/plan/goal_regions/{index:03d}/target"}


def test_the_object_moves_as_it_was_logged(text):
    log = synthetic_log(case("base"))
    times = np.linspace(0.0, 11.9, 60)
    logged = np.column_stack([np.interp(times, log.times, column) for column in log.object_pose.T])
    shown = played(text, OBJECT, "position", times)
    np.testing.assert_allclose(shown[:, :2], logged[:, :2], rtol=0, atol=5e-3)
    keys, turns = track(text, OBJECT, "quaternion")
    angles = np.unwrap(2.0 * np.arctan2(turns[:, 2], turns[:, 3]))
    np.testing.assert_allclose(np.interp(times, keys, angles), logged[:, 2], rtol=0, atol=1e-2)


def test_the_cells_take_turns_as_they_were_logged(text):
    log = synthetic_log(case("base"))
    switches = log.times[np.flatnonzero(np.diff(log.cell_index)) + 1]
    for index in (1, 2, 3):
        for kind in ("cells", "goal_regions"):
            times, visible = track(text, f"/plan/{kind}/{index:03d}", "visible")
            seen = times[visible]
            assert seen.min() == pytest.approx(switches[index - 1], abs=0.05)
            assert times[times > seen.min()][0] == pytest.approx(switches[index], abs=0.05)


def test_an_arrow_is_as_long_as_the_force_is_strong(text):
    log = synthetic_log(case("base"))
    times = np.linspace(1.0, 11.0, 40)
    strength = np.linalg.norm(log.measured_wrenches[:, 0, :2], axis=1)
    lengths = played(text, "/forces/robot_0", "scale", times)[:, 0]
    # Half the weight of one kilogram is a metre, to the next round number.
    np.testing.assert_allclose(lengths, np.interp(times, log.times, strength) / 5.0, rtol=0, atol=0.05)


def test_the_trail_grows_from_nothing_to_the_whole_way(text):
    _, drawn = track(text, "/motion/trail/<object>", "geometry[drawRange].count")
    assert drawn[0] == 0.0
    assert (np.diff(drawn) >= 0.0).all()
    length = np.linalg.norm(np.diff(synthetic_log(case("base")).object_pose[:, :2], axis=0), axis=1).sum()
    assert drawn[-1] == pytest.approx(6.0 * length / 0.03, rel=0.01)


def test_a_page_of_another_make_is_refused():
    with pytest.raises(CoopDrakeError, match="this version of Drake writes recordings in a way"):
        with_overlay("<html><body></body></html>", {})


def test_a_page_goes_into_a_notebook_unharmed():
    assert 'srcdoc="&lt;"' not in inline_frame("<p>")
    assert 'srcdoc="<p class=&quot;a&quot;>&amp;amp;"' in inline_frame('<p class="a">&amp;')


def base(**log):
    """The shipped scenario with a plan and a log."""
    problem = case("base")
    scenario = load_scenario(MODELS / "base.scenario.yaml")
    return scenario, synthetic_plan(problem), synthetic_log(problem, **log)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path, fractions = tmp_path_factory.mktemp("recording") / "transport.html", []
    write_recording(*base(), path, progress=lambda text, fraction: fractions.append(fraction))
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert list(path.parent.iterdir()) == [path]
    return path


def test_a_minute_of_motion_that_no_straight_line_follows_stays_under_6_mb():
    scenario, plan, log = base(samples=1500)
    shaken = np.random.default_rng(0).normal(0.0, 0.1, (len(log.times), 3))
    log = dataclasses.replace(
        log,
        times=log.times * (60.0 / log.times[-1]),
        object_pose=log.object_pose + shaken,
        measured_wrenches=20.0 * shaken[:, None] * np.ones((1, 2, 1)),
    )
    plan = dataclasses.replace(plan, cells=10 * plan.cells, transitions=10 * plan.transitions)
    page = recording_html(scenario, plan, log)
    assert len(track(page, OBJECT, "position")[0]) > 1000
    assert len(page.encode()) < 6e6


def test_collision_geometry_moves_with_the_bodies_where_it_is_asked_for():
    scenario, plan, log = base(samples=40)
    look = dataclasses.replace(scenario.visualization, show_collision=True)
    page = recording_html(dataclasses.replace(scenario, visualization=look), plan, log)
    seen, solid = (
        track(page, f"/team/{role}/object/body", "position") for role in ("illustration", "proximity")
    )
    np.testing.assert_array_equal(seen[1], solid[1])


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ({}, "arrived after 12.0 s"),
        ({"violation": "too near at t = 12 s", "reached": False}, "too near at t = 12 s"),
        ({"reached": False}, "the goal was not reached within 12.0 s"),
    ],
)
def test_the_page_says_how_it_ended(end, words):
    scenario, plan, log = base()
    facts = {"duration": 12.0, "colours": [Rgba(0, 0, 1), Rgba(1, 0, 0)], "of_a_metre": 5.0}
    said = page_content(scenario, plan, dataclasses.replace(log, **end), **facts)["verdict"]
    walls, bodies = log.workspace_clearance.min(), log.body_clearance.min()
    assert said == f"{words}; smallest clearance {walls:.3f} m to walls, {bodies:.3f} m between bodies"


def test_a_run_that_starts_at_its_goal_is_recorded(tmp_path):
    scenario, plan, log = base()
    histories = {name: value[:1] for name, value in vars(log).items() if isinstance(value, np.ndarray)}
    path = tmp_path / "transport.html"
    write_recording(scenario, plan, dataclasses.replace(log, **histories), path)
    assert path.stat().st_size > 1e6
