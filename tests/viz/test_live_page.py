"""The page of a live view shows the run and its verdict, and then the recording, which needs no server."""

from __future__ import annotations

import dataclasses
import json
import threading
from math import inf
from pathlib import Path
from types import SimpleNamespace
from urllib.error import HTTPError
from urllib.request import urlopen

import numpy as np
import pytest
from pydrake.geometry import Meshcat

from coop_drake.scenario import load_scenario
from coop_drake.viz import LivePage
from coop_drake.viz.live import stop_words
from tests.support.cases import case
from tests.support.synthetic_log import synthetic_log, synthetic_plan

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
SCENARIO = Path(__file__).parents[2] / "models" / "base.scenario.yaml"


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
