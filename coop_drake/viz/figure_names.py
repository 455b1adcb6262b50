"""Names of the figures that depend on the team."""

from __future__ import annotations

_FIRST, _LAST = 10, 11


def joints_figure_name(robot: int, name: str) -> str:
    """Name of the figure of a robot's joints: Figure 10 for the first, Figure 11 for every other.

    Args:
        robot: Number of the robot, from 0.
        name: Its name.
    """
    return f"fig{min(_FIRST + robot, _LAST)}_joints_{name}"
