"""The live view and its page show the steps that they receive, the verdict and then the recording."""

import base64
import dataclasses
import gc
import json
import logging
import re
import socket
import threading
from math import inf
from types import SimpleNamespace
from typing import Any
from urllib.error import HTTPError
from urllib.request import urlopen

import numpy as np
import pytest
import umsgpack
from pydrake.geometry import Meshcat, Rgba
from pydrake.systems.framework import DiagramBuilder
from shapely import Polygon, box

from coop_drake.drawing.colours import robot_colour
from coop_drake.errors import CoopDrakeError
from coop_drake.plant import build_team_plant
from coop_drake.scenario import load_scenario
from coop_drake.viz import LivePage, LiveView, inline_frame, live, recording_html, write_recording
from coop_drake.viz.live import stop_words
from coop_drake.viz.recording import kept_frames, page_content, silent_meshcat, with_overlay
from coop_drake.viz.scene import TeamView, TransportScene, hex_colour, illustrations, paint_robots, set_stage
from tests.support.cases import case
from tests.support.scenarios import MODELS
from tests.support.small_plan import with_motion
from tests.support.synthetic_log import synthetic_log, synthetic_plan

_MESSAGE = re.compile(r'fetch\("data:application/octet-binary;base64,([A-Za-z0-9+/=]+)"\)')


def messages(page: str) -> list[dict[str, Any]]:
    """Every command of the page, in its order."""
    return [umsgpack.unpackb(base64.b64decode(packed)) for packed in _MESSAGE.findall(page)]


def paths(page: str) -> set[str]:
    """Where something stands."""
    return {message["path"] for message in messages(page) if message["type"] == "set_object"}


def track(page: str, path: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and values of the key frames of one property."""
    (told,) = [message for message in messages(page) if message["type"] == "set_animation"]
    (clip,) = [animation["clip"] for animation in told["animations"] if animation["path"] == path]
    (keys,) = [one["keys"] for one in clip["tracks"] if one["name"] == f".{name}"]
    times = np.array([key["time"] for key in keys]) / clip["fps"]
    return times, np.array([key["value"] for key in keys])


def played(page: str, path: str, name: str, times: np.ndarray) -> np.ndarray:
    """The property as a browser shows it, on straight lines from key frame to key frame."""
    keys, values = track(page, path, name)
    return np.column_stack([np.interp(times, keys, column) for column in values.reshape(len(keys), -1).T])


def sample(time, x, cell, force, *, arrived=False):
    return SimpleNamespace(
        time=time,
        z=np.array([x, 2.0, 1.57, 0.0, 0.0]),
        cell=cell,
        measured_wrenches=np.array([[force, 0.0, 0.0], [0.0, force, 0.0]]),
        arrived=arrived,
    )


@pytest.fixture
def shown():
    meshcat = Meshcat()
    return LiveView(load_scenario(SCENARIO), synthetic_plan(case("base")), meshcat, rate=inf), meshcat


def visible(meshcat, path):
    return umsgpack.unpackb(meshcat._GetPackedProperty(path, "visible"))["value"]


def x_of(meshcat, path):
    return umsgpack.unpackb(meshcat._GetPackedTransform(path))["matrix"][12]


def test_team_cell_forces_and_trail_follow_the_run(shown):
    view, meshcat = shown
    view(sample(0.0, 0.9, 0, 0.0))
    view(sample(0.1, 1.2, 1, 4.0))
    assert x_of(meshcat, "/team/illustration/object/body") == pytest.approx(1.2)
    assert [visible(meshcat, f"/plan/{kind}/000") for kind in ("cells", "goal_regions")] == [False, False]
    assert [visible(meshcat, f"/plan/{kind}/001") for kind in ("cells", "goal_regions")] == [True, True]
    assert umsgpack.unpackb(meshcat._GetPackedProperty("/forces/robot_1", "scale"))["value"][0] == 0.8
    assert meshcat.HasPath("/motion/trail/00000")
    assert not view.wait_for_viewer(0.0)


def test_steps_just_after_a_frame_are_left_out_but_the_last_one_is_shown(shown):
    view, meshcat = shown
    view(sample(0.0, 0.9, 0, 0.0))
    view(sample(0.01, 1.0, 0, 0.0))
    assert x_of(meshcat, "/team/illustration/object/body") == pytest.approx(0.9)
    view(sample(0.02, 1.1, 0, 0.0, arrived=True))
    assert x_of(meshcat, "/team/illustration/object/body") == pytest.approx(1.1)


def test_a_run_that_is_ahead_of_time_waits(shown, monkeypatch):
    now, waited = [100.0], []
    monkeypatch.setattr(live, "monotonic", lambda: now[0])
    monkeypatch.setattr(live, "sleep", waited.append)
    view = LiveView(load_scenario(SCENARIO), synthetic_plan(case("base")), shown[1], rate=2.0)
    view(sample(0.0, 0.9, 0, 0.0))
    now[0] += 0.5
    view(sample(3.0, 0.9, 0, 0.0))
    assert waited == [pytest.approx(1.0)]


SCENARIO = MODELS / "base.scenario.yaml"


PROCESSES = [
    {
        "name": "robot 0",
        "state": "holds",
        "missing_since": None,
        "age": 0.0012,
        "team_messages": 7,
        "refused": 1,
    },
    {
        "name": "the supervisor",
        "state": "gone",
        "missing_since": 2.5,
        "age": 0.001,
        "team_messages": 0,
        "refused": 0,
    },
]


STOP = {"cause": "robot 1", "since": 2.5, "rested": None, "resumed": None}

FACTS = {"processes": PROCESSES, "stops": [STOP | {"resumed": 3.0}, STOP]}


@pytest.fixture(scope="module")
def served():
    gc.collect()  # Meshcat may end only where it was made: threads of servers must not find old ones.
    meshcat = Meshcat()
    plan = synthetic_plan(case("base"))
    with LivePage(load_scenario(SCENARIO), plan, meshcat, rate=inf, facts=lambda: FACTS) as page:
        yield page, meshcat


def got(page, path):
    with urlopen(page.url + path, timeout=10.0) as answer:
        return answer.read().decode()


def test_the_page_has_title_and_key_and_takes_the_scene_from_meshcat(served):
    page, meshcat = served
    text = got(page, "/")
    assert "base: 2 robots carry one object" in text
    assert "goal: the frame that the object fits into" in text
    assert f'"port": {meshcat.port()}' in text


def test_it_tells_where_the_run_is_and_how_it_ended(served):
    page, _ = served
    page(
        SimpleNamespace(
            time=1.5,
            z=np.array([0.9, 2.0, 1.57, 0.0, 0.0]),
            rates=np.array([0.3, 0.4, 0.0, 0.0, 0.0]),
            cell=1,
            measured_wrenches=np.zeros((2, 3)),
            arrived=False,
        )
    )
    news = json.loads(got(page, "/news"))
    assert news["details"] == "1.5 s, cell 2 of 5, object at 0.50 m/s"
    assert [[*row.values()] for row in news["processes"]] == [
        ["robot 0", "holds", "1.2 ms", "7", "1"],
        ["the supervisor", "gone since 2.50 s", "", "0", "0"],
    ]
    assert news["stop"] == "All drives brake since 2.50 s because of robot 1"
    assert stop_words([STOP | {"rested": 3.1}]).endswith("because of robot 1; the team rests since 3.10 s")
    assert stop_words(FACTS["stops"][:1]) == stop_words(()) == ""
    assert not news["verdict"]
    log = synthetic_log(case("base"))
    page.show_verdict(dataclasses.replace(log, reached=False))
    news = json.loads(got(page, "/news"))
    assert news["verdict"].startswith("the goal was not reached within 12.0 s; smallest clearance ")
    assert news["reached"] is False


def test_a_browser_gets_the_recording_before_the_server_ends(served, tmp_path):
    page, _ = served
    with pytest.raises(HTTPError, match="404"):
        got(page, "/transport.html")
    recording, loaded = tmp_path / "transport.html", []
    recording.write_text("the recording")
    got(page, "/news")  # The browser is there.

    def browse():
        while not json.loads(got(page, "/news"))["recording"]:
            pass
        loaded.append(got(page, "/transport.html"))

    browser = threading.Thread(target=browse)
    browser.start()
    page.hand_over(recording)
    assert loaded == ["the recording"]
    browser.join()


def test_a_server_that_is_started_says_nothing_and_others_that_are_started_later_do(caplog):
    caplog.set_level(logging.INFO, "drake")
    assert silent_meshcat().web_url().startswith("http://localhost:")
    assert caplog.messages == []
    Meshcat()
    assert [line.partition(" at ")[0] for line in caplog.messages] == ["Meshcat listening for connections"]


def test_only_browsers_on_this_machine_reach_it():
    meshcat = silent_meshcat()
    with socket.create_connection(("127.0.0.1", meshcat.port()), timeout=10.0):
        pass
    # Another address of this machine: a server that listens on all of them would answer.
    with pytest.raises((ConnectionRefusedError, TimeoutError)):
        socket.create_connection(("127.0.0.2", meshcat.port()), timeout=10.0)


# The recording is one small page that needs nothing else and shows what the log holds.

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


def test_arrows_of_a_team_that_passes_are_longer_for_its_forces_are_smaller():
    scenario, plan, _ = base()
    plans = (plan, with_motion(plan))
    scales = [TransportScene(scenario, each, silent_meshcat()).of_a_metre for each in plans]
    # Half a kilogram's weight, and the force that gives it 1.5 m/s^2, each to the next round number.
    assert scales == pytest.approx([5.0, 1.0])


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
    path = tmp_path_factory.mktemp("recording") / "transport.html"
    write_recording(*base(), path)
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


# Obstacles on the floor and the colours of robots.

FLOOR = box(0, 0, 6, 5)

SHELF, PILLAR = Polygon([(1, 1), (3, 1.5), (2.9, 1.9), (0.9, 1.4)]), box(4, 3, 4.4, 3.3)


def staged(floor):
    meshcat = Meshcat()
    set_stage(meshcat, floor, 0.5)
    return meshcat


def test_a_long_obstacle_is_a_shelf_a_short_one_a_pillar_and_one_that_is_not_convex_a_wall():
    def kinds(floor):
        has = staged(floor).HasPath
        found = {f"{kind}/0{k}" for kind in ("shelves", "pillars") for k in (0, 1)}
        return sorted(kind.split("/")[0] for kind in found if has(f"/stage/{kind}"))

    corner = Polygon([(1, 1), (3, 1), (3, 1.2), (1.2, 1.2), (1.2, 3), (1, 3)])
    assert kinds(FLOOR - SHELF - PILLAR) == ["pillars", "shelves"]
    assert kinds(FLOOR - corner - PILLAR) == ["pillars"]


@pytest.fixture
def twins(tmp_path):
    """The shipped team with two robots of the same model."""
    path = tmp_path / "twins.scenario.yaml"
    path.write_text((MODELS / "base.scenario.yaml").read_text().replace("long_orange", "long_blue"))
    return load_scenario(path)


def painted(team, body):
    inspector = team.scene_graph.model_inspector()
    known = [inspector.GetIllustrationProperties(one) for one in illustrations(team, body)]
    return {hex_colour(one.GetProperty("phong", "diffuse")) for one in known}


def test_robots_of_one_model_get_the_colours_of_the_figures(twins):
    builder = DiagramBuilder()
    team = build_team_plant(twins, builder)
    assert [hex_colour(one) for one in paint_robots(team)] == [robot_colour(k).lower() for k in (0, 1)]
    builder.Build()
    first, second = (painted(team, robot.base_body) for robot in team.robots)
    assert robot_colour(0).lower() in first
    assert robot_colour(1).lower() in second
    # The chassis is grey in both.
    assert len(first & second) == 1


def test_the_scene_paints_arrows_and_grasps_alike(twins):
    assert hex_colour(TeamView(twins, Meshcat()).colours[1]) == robot_colour(1).lower()


def test_robots_of_different_models_keep_their_colours():
    builder = DiagramBuilder()
    team = build_team_plant(load_scenario(SCENARIO), builder)
    before = [painted(team, robot.base_body) for robot in team.robots]
    colours = [hex_colour(one) for one in paint_robots(team)]
    builder.Build()
    assert [painted(team, robot.base_body) for robot in team.robots] == before
    assert len(set(colours)) == 2
