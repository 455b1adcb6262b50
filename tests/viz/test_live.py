"""The live view shows the steps that it receives, and keeps to real time."""

from __future__ import annotations

from math import inf
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import umsgpack
from pydrake.geometry import Meshcat

from coop_drake.scenario import load_scenario
from coop_drake.viz import LiveView, live
from tests.support.cases import case
from tests.support.synthetic_log import synthetic_plan

SCENARIO = Path(__file__).parents[2] / "models" / "base.scenario.yaml"


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


def test_a_cell_is_touched_when_it_changes_only(shown):
    view, meshcat = shown
    view(sample(0.0, 0.9, 1, 0.0))
    meshcat.SetProperty("/plan/cells/001", "visible", False)  # as who watches may do
    view(sample(0.1, 0.9, 1, 0.0))
    assert not visible(meshcat, "/plan/cells/001")
    view(sample(0.2, 0.9, 2, 0.0))
    assert visible(meshcat, "/plan/cells/002")


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


def test_without_a_browser_the_wait_ends_and_returns_false(shown):
    assert not shown[0].wait_for_viewer(0.0)
