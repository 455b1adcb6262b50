"""Executed notebooks as pages of the documentation: pictures in files, recordings in frames, text as text."""

from __future__ import annotations

import base64

import nbformat
import pytest
from nbformat import v4

from coop_drake import inline_frame
from docs.generate.notebook_pages import write_notebook_pages


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
