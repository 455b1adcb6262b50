"""The live view and its page show the steps that they receive, the verdict and then the recording."""

import dataclasses
import json
import logging
import socket
import threading
from math import inf
from types import SimpleNamespace
from urllib.error import HTTPError
from urllib.request import urlopen

import numpy as np
import pytest
import umsgpack
from pydrake.geometry import Meshcat

from coop_drake.scenario import load_scenario
from coop_drake.viz import LivePage, LiveView, live
from coop_drake.viz.live import stop_words
from coop_drake.viz.recording import silent_meshcat
from tests.support.cases import case
from tests.support.scenarios import MODELS
from tests.support.synthetic_log import synthetic_log, synthetic_plan


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


@pytest.fixture
def logged():
    records = []

    class Collector(logging.Handler):
        def emit(self, record):
            records.append(record.getMessage())

    logger, collector = logging.getLogger("drake"), Collector()
    level = logger.level
    logger.addHandler(collector)
    logger.setLevel(logging.INFO)
    yield records
    logger.setLevel(level)
    logger.removeHandler(collector)


def test_a_server_that_is_started_says_nothing(logged):
    assert silent_meshcat().web_url().startswith("http://localhost:")
    assert logged == []


def test_only_browsers_on_this_machine_reach_it():
    meshcat = silent_meshcat()
    with socket.create_connection(("127.0.0.1", meshcat.port()), timeout=10.0):
        pass
    # Another address of this machine: a server that listens on all of them would answer.
    with pytest.raises((ConnectionRefusedError, TimeoutError)):
        socket.create_connection(("127.0.0.2", meshcat.port()), timeout=10.0)
