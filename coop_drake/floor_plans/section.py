"""Writes a floor as the section ``workspace`` of a scenario file."""

from __future__ import annotations

from shapely import Polygon

from coop_drake.geometry.parts import corners_of
from coop_drake.tree.pose import FloatArray

_DECIMALS = 9
"""Decimals of a metre that are written."""
_WIDTH = 100
"""Longest line [characters]."""


def workspace_section(floor: Polygon, comment: str) -> str:
    """YAML text of a floor's rings, rounded to a nanometre, below a comment of one line."""
    outer, *holes = (_ring(corners) for corners in corners_of(floor))
    lines = [f"# {' '.join(comment.split())}", "workspace:", "  outer: [", *_indented(outer, 4), "  ]"]
    if holes:
        lines.append("  holes:")
    for hole in holes:
        lines += ["  - [", *_indented(hole, 4), "  ]"]
    return "\n".join(lines) + "\n"


def _ring(corners: FloatArray) -> list[str]:
    return [f"[{_number(x)}, {_number(y)}]," for x, y in (corners.round(_DECIMALS) + 0.0).tolist()]


def _number(value: float) -> str:
    """A decimal number with a point and no exponent, which YAML 1.1 could read as text."""
    text = f"{value:.{_DECIMALS}f}".rstrip("0")
    return text + "0" if text.endswith(".") else text


def _indented(words: list[str], indent: int) -> list[str]:
    """Words joined to lines of at most ``_WIDTH`` characters."""
    lines = [""]
    for word in words:
        if lines[-1] and len(lines[-1]) + len(word) + 1 > _WIDTH - indent:
            lines.append("")
        lines[-1] += f" {word}" if lines[-1] else word
    return [" " * indent + line for line in lines]
