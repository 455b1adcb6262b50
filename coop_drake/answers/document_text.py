"""JSON documents as text: the same bytes for the same content, one line a row, with a digest in the head."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import shapely
from shapely import Polygon

from coop_drake.answers.digest import content_digest

__all__ = ["document_text", "polygon_entry"]


def document_text(head: Mapping[str, Any], rows: Mapping[str, Sequence[Any]]) -> str:
    """Write a document so that eyes and diffs can follow it.

    Args:
        head: Entries of one line each.
        rows: Entries that are lists, with one line for every item.

    Returns:
        The text, with the entry ``digest`` at the end of the head.
    """
    digest = content_digest({**head, **rows})
    lines = [f' "{key}": {_line(value)}' for key, value in {**head, "digest": digest}.items()]
    for key, items in rows.items():
        lines.append(f' "{key}": [\n  ' + ",\n  ".join(_line(item) for item in items) + "\n ]")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def polygon_entry(polygon: Polygon) -> dict[str, Any]:
    """A polygon's rings without their closing vertices."""
    outer, *holes = (
        shapely.get_coordinates(ring)[:-1].tolist() for ring in (polygon.exterior, *polygon.interiors)
    )
    return {"outer": outer, "holes": holes}


def _line(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)
