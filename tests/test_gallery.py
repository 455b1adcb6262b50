"""The galleries: their scenarios load, and their page says what was run and what came of it."""

from __future__ import annotations

import pytest

from coop_drake.plant import planning_problem
from coop_drake.scenario import load_scenario
from docs.gallery import __main__ as gallery
from docs.gallery.cases import FLOORS, TEAMS
from docs.gallery.page import gallery_page
from docs.gallery.stills import BrowserError, browser

ARRIVED = {
    "answer": "found",
    "outcome": "arrived",
    "cells": 3,
    "simulated_seconds": 9.3,
    "min_workspace_clearance_m": 0.25,
    "min_body_clearance_m": 0.1,
    "peak_speed_m_s": 0.53,
}
PROVED = {"answer": "infeasible", "reason": "the doorway is too narrow"}


@pytest.mark.parametrize("case", [case for case in FLOORS if case.file], ids=lambda case: case.name)
def test_its_own_floors_are_scenarios(case):
    assert planning_problem(load_scenario(case.file)).workspace.interiors


def test_every_case_has_its_still_its_answer_and_its_commands():
    page = gallery_page(
        {"Six floors": [(FLOORS[0], ARRIVED), (FLOORS[5], PROVED)], "Teams": [(TEAMS[1], ARRIVED)]}
    )
    assert "[![base](base.png)](base.html)" in page
    assert "**Arrived after 9.3 s** through 3 cells; smallest clearance 0.250 m to walls, 0.100 m" in page
    assert "![closed](closed.png)" in page
    assert "closed.html" not in page
    assert "infeasible.** The doorway is too narrow." in page
    assert "$ coop-drake new three_robots --robots 3\n$ coop-drake run three_robots/three_robots" in page


def test_without_a_browser_nothing_is_run(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BrowserError, match="install one of chromium"):
        browser()
    assert gallery.main(tmp_path / "gallery") == 2
    assert "install one of chromium" in capsys.readouterr().err
    assert not (tmp_path / "gallery").exists()
