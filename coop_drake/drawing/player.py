"""The style sheet of pages that play a scene: headline above, key of colours and player below."""

from __future__ import annotations

from coop_drake.drawing import colours
from coop_drake.templates import rendered


def player_style() -> str:
    """Return the style sheet, in the colours of all pictures."""
    return rendered("coop_drake.drawing", "player.css", colours=colours)
