"""What colours mean in the figures and in the scene; they stay apart for colour-blind readers."""

from __future__ import annotations

from coop_drake.drawing.colours import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILLION

__all__ = [
    "BLOCKED",
    "CHANNEL",
    "FREE",
    "GUIDE",
    "LOOKED_AT",
    "MIXED",
    "OPEN_CHANNEL",
    "OTHERS",
    "PARTLY_FREE",
    "REACHED",
    "mixture",
]

FREE = BLUE
PARTLY_FREE = "#c4dceb"  # The least that is called proved free in part.
GUIDE = SKY
MIXED = ORANGE
BLOCKED = "#8c8c8c"
CHANNEL = INK
OPEN_CHANNEL = VERMILLION
LOOKED_AT = INK
REACHED = GREEN
OTHERS = PURPLE


def mixture(first: str, second: str, share: float) -> str:
    """Colour between two colours ``#rrggbb``, the second one at ``share`` 1."""
    a, b = (tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5)) for colour in (first, second))
    return "#" + "".join(f"{round(p + share * (q - p)):02x}" for p, q in zip(a, b, strict=True))
