"""Pages of executed notebooks: their text, code and output, with every picture in a file of its own."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat

_FRAME = re.compile(r'<iframe srcdoc="(.*?)" width="100%" height="(\d+)"', re.DOTALL)
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_PICTURES = {"image/svg+xml": "svg", "image/png": "png"}


def write_notebook_pages(notebooks: Path, pages: Path) -> list[str]:
    """Write a page for every notebook of a folder; return their names in order.

    Args:
        notebooks: Folder of executed notebooks.
        pages: Receives Markdown pages, pictures and recordings.

    Raises:
        ValueError: A notebook was not executed, or there is none.
    """
    pages.mkdir(parents=True, exist_ok=True)
    names = []
    for path in sorted(notebooks.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
        if any(cell.cell_type == "code" and cell.execution_count is None for cell in notebook.cells):
            raise ValueError(f"{path}: not executed; `python -m notebooks DIR` writes executed copies")
        text = "\n\n".join(_blocks(notebook.cells, path.stem, pages))
        (pages / f"{path.stem}.md").write_text(text + "\n", encoding="utf-8")
        names.append(f"{path.stem}.md")
    if not names:
        raise ValueError(f"{notebooks}: no notebook; `python -m notebooks DIR` writes executed copies")
    return names


def _blocks(cells: list[Any], stem: str, pages: Path) -> Iterator[str]:
    count = 0
    for cell in cells:
        if cell.cell_type == "markdown":
            yield cell.source
            continue
        yield f"```python\n{cell.source}\n```"
        for output in cell.get("outputs", []):
            if output.output_type == "stream":
                yield _text(output.text)
            else:
                yield _shown(output.data, f"{stem}_{count}", pages)
                count += 1


def _text(text: str) -> str:
    return f"```text\n{_COLOURS.sub('', text).rstrip()}\n```"


def _shown(data: Any, name: str, pages: Path) -> str:
    """Write what a cell shows into a file, and return what shows it in the page."""
    frame = _FRAME.search(data.get("text/html", ""))
    if frame:
        (pages / f"{name}.html").write_text(html.unescape(frame[1]), encoding="utf-8")
        return f'<iframe src="{name}.html" width="100%" height="{frame[2]}" style="border: 0"></iframe>'
    for kind, ending in _PICTURES.items():
        if kind in data:
            content = data[kind].encode() if ending == "svg" else base64.b64decode(data[kind])
            (pages / f"{name}.{ending}").write_bytes(content)
            return f"![output of the cell above]({name}.{ending})"
    return _text(str(data.get("text/plain", "")))
