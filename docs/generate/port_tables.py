"""An extension of griffe that turns the tables of ports in docstrings, ruled with ``=``, into markdown."""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

_RULER = re.compile(r"^\s*=+( +=+)+\s*$")
_HEADS = ("", "port", "size", "meaning", "frame")


class PortTables(Extension):
    """Rewrites the tables in the docstrings that griffe reads."""

    def on_instance(self, *, obj: Object, **kwargs: Any) -> None:
        """Rewrite the docstring of an object that has one."""
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)


def as_markdown(docstring: str) -> str:
    """Return the docstring with every ruled table as markdown."""
    lines, rulers = docstring.splitlines(), []
    for number, line in enumerate(lines):
        if _RULER.match(line):
            rulers.append(number)
    for first, last in reversed(list(zip(rulers[::2], rulers[1::2], strict=True))):
        lines[first : last + 1] = _table(lines[first], lines[first + 1 : last])
    return "\n".join(lines)


def _table(ruler: str, rows: list[str]) -> list[str]:
    """Return the lines of a table; a row whose first column is empty continues the row before."""
    spans = [match.span() for match in re.finditer("=+", ruler)]
    ends = [start for start, _ in spans[1:]] + [None]
    cells: list[list[str]] = []
    for row in rows:
        parts = [row[start:end].strip() for (start, _), end in zip(spans, ends, strict=True)]
        if parts[0] or not cells:
            cells.append(parts)
        else:
            cells[-1] = [f"{above} {part}".strip() for above, part in zip(cells[-1], parts, strict=True)]
    table = [_HEADS[: len(spans)], ("---",) * len(spans), *cells]
    return ["", *("| " + " | ".join(row) + " |" for row in table), ""]
