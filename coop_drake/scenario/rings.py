"""Checks the rings of a workspace: edges do not cross, holes are inside the outer ring and apart."""

from collections.abc import Sequence

import numpy as np
from shapely import LineString, Polygon, STRtree
from shapely.validation import explain_validity

from coop_drake.errors import ScenarioError
from coop_drake.scenario.model import Scenario

Ring = Sequence[tuple[float, float]]

_LEAST_AREA = 1e-9
"""Rings with a smaller area are degenerate [m^2]."""


def check_workspace(scenario: Scenario) -> None:
    """Refuse rings that do not enclose one connected floor.

    Raises:
        ScenarioError: Naming the ring, and the corner if a single one is wrong.
    """
    file, workspace = str(scenario.path), scenario.workspace
    _check_ring(file, "workspace.outer", workspace.outer)
    floor = Polygon(workspace.outer)
    holes: list[Polygon] = []
    for index, ring in enumerate(workspace.holes):
        key = f"workspace.holes[{index}]"
        _check_ring(file, key, ring)
        hole = Polygon(ring)
        if not floor.contains(hole):
            where = "across" if floor.intersects(hole) else "outside"
            raise ScenarioError(file, key, _plain(ring), f"a hole inside workspace.outer, not {where} it")
        for other, earlier in enumerate(holes):
            if not hole.disjoint(earlier) and not hole.touches(earlier):
                raise ScenarioError(file, key, _plain(ring), f"a hole apart from workspace.holes[{other}]")
        holes.append(hole)
    if not workspace.polygon.is_valid:
        reason = explain_validity(workspace.polygon)
        raise ScenarioError(file, "workspace", reason, "holes that leave the floor in one piece")


def _check_ring(file: str, key: str, ring: Ring) -> None:
    if len({tuple(corner) for corner in ring}) < 3:
        raise ScenarioError(file, key, _plain(ring), "three or more different corners")
    for index, corner in enumerate(ring):
        if len(corner) != 2:
            raise ScenarioError(file, f"{key}[{index}]", list(corner), "two coordinates, x and y")
    polygon = Polygon(ring)
    if polygon.is_valid:
        if polygon.area < _LEAST_AREA:
            raise ScenarioError(
                file, key, _plain(ring), f"a ring with an area of {_LEAST_AREA:g} m^2 or more"
            )
        return
    first, second, place = _meeting_edges(ring)
    raise ScenarioError(
        file,
        f"{key}[{first}]",
        list(ring[first]),
        f"a ring that does not cross or touch itself (the edges that leave corners {first} and {second} "
        f"meet at ({place[0]:g}, {place[1]:g}))",
    )


def _meeting_edges(ring: Ring) -> tuple[int, int, tuple[float, float]]:
    """Return the first two edges that meet elsewhere than at a common corner, and where they meet."""
    corners = [index for index in range(len(ring)) if tuple(ring[index]) != tuple(ring[index - 1])]
    ends = zip(corners, corners[1:] + corners[:1], strict=True)
    edges = [LineString([ring[a], ring[b]]) for a, b in ends]
    pairs = STRtree(edges).query(edges, predicate="intersects")
    for first, second in sorted(zip(*pairs.tolist(), strict=True)):
        if first >= second:
            continue
        common = edges[first].intersection(edges[second])
        neighbours = second - first in (1, len(edges) - 1)
        if not (neighbours and common.geom_type == "Point"):
            x, y = np.array(common.representative_point().coords)[0]
            return corners[first], corners[second], (float(x), float(y))
    raise AssertionError("a ring whose edges do not meet is valid")


def _plain(ring: Ring) -> list[list[float]]:
    return [list(corner) for corner in ring]
