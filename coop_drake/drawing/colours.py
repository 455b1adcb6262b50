"""Every colour of figures, scenes and pages, as ``#rrggbb``: what it stands for is the same in all of them.

Only the team's bodies in a scene have other colours: those of their models (``models/*.sdf``).
The palette is that of Okabe and Ito, whose colours stay apart for colour-blind readers and in print.
"""

from __future__ import annotations

# Text, lines and paper.
INK = "#222222"
GREY = "#777777"
LIGHT_GREY = "#999999"
PAPER = "#ffffff"

# The palette.
BLUE = "#0072B2"
VERMILLION = "#D55E00"
GREEN = "#009E73"
ORANGE = "#E69F00"
SKY = "#56B4E9"
PURPLE = "#CC79A7"

# The floor plan, and what stands on it.
FLOOR = PAPER
WALL = "#d4d4d4"
OBJECT = "#8A6642"
_ROBOTS = (BLUE, VERMILLION, GREEN, PURPLE, SKY)

# The same in space, where light and shade change colours.
FLOOR_IN_SPACE = "#f7f5f0"
GRID = "#b8b8b8"
WALL_IN_SPACE = "#808c9e"
PILLAR = "#6b7585"
SHELF = "#b88f5c"
EDGE = "#21262e"

# The bodies of models that this package writes: red, green, blue and opacity, as SDF files have them.
OBJECT_IN_MODELS = "0.76 0.60 0.42 1"
BASE_IN_MODELS = "0.13 0.36 0.62 1"
LINK_IN_MODELS = "0.45 0.66 0.86 1"

# What the planner knows of positions and slices, and the channel that it follows through them.
PROVED_FREE = BLUE
PARTLY_FREE = "#c4dceb"  # The least part of a slice that is proved free; PROVED_FREE stands for all of it.
GUIDE = SKY
UNDECIDED = ORANGE
BLOCKED = "#8c8c8c"
CHANNEL = INK
UNDECIDED_CHANNEL = VERMILLION
HALVED = INK
REACHED = GREEN
UNREACHED = PURPLE

# Why there is no plan: bodies that are in the way, the others, and what lies outside the floor.
AT_FAULT = VERMILLION
NOT_AT_FAULT = "#b9c4cc"
OUTSIDE = "#8b0000"

BLOCK_OF_DIAGRAM = "#f4f4f4"


def robot_colour(index: int) -> str:
    """Return the colour of robot ``index``; colours repeat after five robots."""
    return _ROBOTS[index % len(_ROBOTS)]


def red_green_blue(colour: str) -> tuple[int, int, int]:
    """Return the three components of a colour, each from 0 to 255."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue


def blend(first: str, second: str, fraction: float) -> str:
    """Return a colour between two, the second one where ``fraction`` is 1."""
    pairs = zip(red_green_blue(first), red_green_blue(second), strict=True)
    return "#" + "".join(f"{round(a + fraction * (b - a)):02x}" for a, b in pairs)
