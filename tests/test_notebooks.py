"""Notebooks run and end in an asserted number; they and the gallery have their pages."""

from __future__ import annotations

import base64

import nbformat
import pytest
from nbformat import v4

from coop_drake import inline_frame
from coop_drake.plant import planning_problem
from coop_drake.scenario import load_scenario
from docs.gallery import __main__ as gallery
from docs.gallery.cases import FLOORS, TEAMS
from docs.gallery.page import gallery_page
from docs.gallery.stills import BrowserError, browser
from docs.generate.notebook_pages import write_notebook_pages
from notebooks.execute import HERE, execute

NOTEBOOKS = sorted(HERE.glob("*.ipynb"))


def code_cells(path):
    return [cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]


def test_there_is_a_notebook():
    assert NOTEBOOKS


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_committed_without_output(path):
    assert all(not cell.outputs and cell.execution_count is None for cell in code_cells(path))


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_ends_in_an_assertion_that_holds(path):
    assert "assert " in code_cells(path)[-1].source
    executed = execute(path)
    last = [cell for cell in executed.cells if cell.cell_type == "code"][-1]
    assert last.execution_count == len(code_cells(path))


def test_the_first_notebook_shows_a_recording_inline():
    shown = code_cells(NOTEBOOKS[0])
    assert any("inline_frame(recording_html(" in cell.source for cell in shown)


# Executed notebooks as pages of the documentation: pictures in files, recordings in frames, text as text.


def _written(folder, *outputs, executed=True):
    code = v4.new_code_cell("draw()", outputs=list(outputs), execution_count=1 if executed else None)
    notebook = v4.new_notebook(cells=[v4.new_markdown_cell("# Title"), code])
    folder.mkdir()
    nbformat.write(notebook, folder / "01_one.ipynb")
    return folder


def test_a_page_has_text_code_and_what_each_cell_shows(tmp_path):
    png, page = b"\x89PNG of a figure", '<p class="a">1 & 2</p>'
    executed = _written(
        tmp_path / "executed",
        v4.new_output("stream", name="stdout", text="3 cells\n"),
        v4.new_output("display_data", {"image/png": base64.b64encode(png).decode(), "text/plain": "Figure"}),
        v4.new_output("display_data", {"text/html": inline_frame(page)}),
        v4.new_output("execute_result", {"text/plain": "0.25"}, execution_count=1),
    )
    assert write_notebook_pages(executed, tmp_path / "pages") == ["01_one.md"]
    text = (tmp_path / "pages" / "01_one.md").read_text()
    shown = ["# Title", "```python\ndraw()\n```", "```text\n3 cells\n```", "(01_one_0.png)", "01_one_1.html"]
    places = [text.index(part) for part in [*shown, "```text\n0.25\n```"]]
    assert places == sorted(places)
    assert (tmp_path / "pages" / "01_one_0.png").read_bytes() == png
    assert (tmp_path / "pages" / "01_one_1.html").read_text() == page


def test_notebooks_that_were_not_executed_are_refused(tmp_path):
    with pytest.raises(ValueError, match="not executed; `python -m notebooks DIR`"):
        write_notebook_pages(_written(tmp_path / "as_committed", executed=False), tmp_path / "pages")
    with pytest.raises(ValueError, match="no notebook"):
        write_notebook_pages(tmp_path / "pages", tmp_path / "more")


# The galleries: their scenarios load, and their page says what was run and what came of it.


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
