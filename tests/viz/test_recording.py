"""The recording is one page that needs nothing else."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from coop_drake.scenario import load_scenario
from coop_drake.viz import inline_frame, write_recording
from coop_drake.viz.recording import _interpolate
from tests.support.cases import case
from tests.support.synthetic_log import synthetic_log, synthetic_plan

MODELS = Path(__file__).parents[2] / "models"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    problem = case("base")
    scenario = load_scenario(MODELS / "base.scenario.yaml")
    path = tmp_path_factory.mktemp("recording") / "transport.html"
    fractions = []
    write_recording(
        scenario,
        synthetic_plan(problem),
        synthetic_log(problem),
        path,
        progress=lambda text, fraction: fractions.append(fraction),
    )
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    return path


def test_the_page_is_self_contained_and_small(page):
    text = page.read_text()
    assert page.stat().st_size < 15e6
    assert not re.search(r'<(?:script|link|img)[^>]+(?:src|href)="(?!data:)', text)


def test_nothing_is_left_beside_the_page(page):
    assert list(page.parent.iterdir()) == [page]


def test_a_run_that_starts_at_its_goal_is_recorded(tmp_path):
    problem = case("base")
    one = synthetic_log(problem)
    one = dataclasses.replace(one, **{name: getattr(one, name)[:1] for name in _histories(one)})
    path = tmp_path / "transport.html"
    write_recording(load_scenario(MODELS / "base.scenario.yaml"), synthetic_plan(problem), one, path)
    assert path.stat().st_size > 1e6


def _histories(log):
    return [
        field.name for field in dataclasses.fields(log) if isinstance(getattr(log, field.name), np.ndarray)
    ]


def test_frames_lie_on_the_logged_motion():
    log = synthetic_log(case("base"))
    frames = _interpolate(log, log.times[::7])
    np.testing.assert_allclose(frames, np.hstack([log.object_pose, log.joints])[::7], rtol=0, atol=1e-12)


def test_a_page_goes_into_a_notebook_unharmed():
    assert 'srcdoc="&lt;"' not in inline_frame("<p>")
    assert 'srcdoc="<p class=&quot;a&quot;>&amp;amp;"' in inline_frame('<p class="a">&amp;')
