"""Colours that stay apart for colour-blind readers and in print."""

from __future__ import annotations

__all__ = [
    "BLUE",
    "FLOOR",
    "GREEN",
    "GREY",
    "INK",
    "OBJECT",
    "ORANGE",
    "PURPLE",
    "SKY",
    "VERMILLION",
    "WALL",
    "robot_colour",
]

INK = "#222222"
GREY = "#777777"
FLOOR = "#ffffff"
WALL = "#d4d4d4"

# Okabe and Ito's palette.
BLUE = "#0072B2"
VERMILLION = "#D55E00"
GREEN = "#009E73"
ORANGE = "#E69F00"
SKY = "#56B4E9"
PURPLE = "#CC79A7"

OBJECT = "#8A6642"
_ROBOTS = (BLUE, VERMILLION, GREEN, PURPLE, SKY)


def robot_colour(index: int) -> str:
    """Return the colour of robot ``index``; colours repeat after five robots."""
    return _ROBOTS[index % len(_ROBOTS)]
