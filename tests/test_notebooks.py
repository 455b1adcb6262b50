"""Every notebook is committed without output, runs from top to bottom, and ends in an asserted number."""

from __future__ import annotations

import nbformat
import pytest

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
