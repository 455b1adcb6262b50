"""Random floors of five kinds, made to the measure of a team, with regions in which it starts and ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan, pi

import numpy as np
import shapely
from shapely import Polygon, affinity, box
from shapely.geometry.base import BaseGeometry

Random = np.random.Generator

_DIGITS = 4
"""Decimals of a metre to which corners are rounded."""


@dataclass(frozen=True)
class RandomFloor:
    """A floor.

    Attributes:
        kind: Its kind, a key of ``FLOORS``.
        polygon: Outer ring and holes [m].
        first: Region that the object's start is drawn from [m].
        last: Region that its goal is drawn from [m].
        width: Width of the passages between them [m], NaN where the obstacles lie anywhere.
    """

    kind: str
    polygon: Polygon
    first: Polygon
    last: Polygon
    width: float


@dataclass(frozen=True)
class _Draft:
    floor: BaseGeometry
    first: Polygon
    last: Polygon
    width: float = nan


def random_floor(random: Random, kind: str, reach: float, narrowest: float) -> RandomFloor | None:
    """Draw a floor for a team, None where no piece of floor that the obstacles leave meets both regions.

    Half of the floors are turned by a random angle, the others keep their walls along the axes.

    Args:
        random: Source of all draws.
        kind: A key of ``FLOORS``.
        reach: Bound of how far the team reaches from the object's origin [m].
        narrowest: Width of the narrowest straight corridor in which the team fits, as far as known [m].
    """
    draft = FLOORS[kind](random, reach, narrowest)
    angle = float(random.uniform(-pi, pi)) if random.random() < 0.5 else 0.0
    parts = [part for part in shapely.get_parts(draft.floor) if isinstance(part, Polygon)]
    if not parts:
        return None
    placed = [
        affinity.rotate(shape, angle, origin=(0.0, 0.0), use_radians=True)
        for shape in (max(parts, key=lambda part: part.area), draft.first, draft.last)
    ]
    floor = shapely.transform(placed[0].simplify(1e-6), lambda xy: xy.round(_DIGITS))
    if not isinstance(floor, Polygon) or not floor.is_valid or not all(map(floor.intersects, placed[1:])):
        return None
    return RandomFloor(kind, floor, placed[1], placed[2], draft.width)


def _room(random: Random, reach: float, narrowest: float) -> _Draft:
    """A room with boxes and convex polygons anywhere."""
    length, width = random.uniform((3.0, 2.2), (5.0, 3.6)) * reach
    obstacles = [
        _blob(random, random.uniform((0.0, 0.0), (length, width)), random.uniform(0.1, 0.45) * reach)
        for _ in range(int(random.integers(2, 10)))
    ]
    floor = box(0.0, 0.0, length, width).difference(shapely.union_all(obstacles))
    return _Draft(floor, box(0.0, 0.0, 0.35 * length, width), box(0.65 * length, 0.0, length, width))


def _corridor(random: Random, reach: float, narrowest: float) -> _Draft:
    """Two rooms and a corridor between them, straight or with a right-angled bend."""
    width = float(random.uniform(0.85, 1.6)) * narrowest
    room = np.maximum(random.uniform(2.0, 2.6, (2, 2)) * reach, 1.2 * width)
    length = float(random.uniform(0.4, 2.0)) * reach
    (a, b), (c, d) = room
    low = float(random.uniform(0.0, b - width))
    first = box(0.0, 0.0, a, b)
    if random.random() < 0.5:
        y = low - float(random.uniform(0.0, d - width))
        last = box(a + length, y, a + length + c, y + d)
        passages = [box(a, low, a + length, low + width)]
    else:  # The corridor leaves to the right, turns, and enters the second room from below.
        far, rise = a + length + width, max(length, b - low + 0.2 * reach)
        x = far - width - float(random.uniform(0.0, c - width))
        x = max(x, a + 0.1 * reach)
        x = min(x, far - width)
        last = box(x, low + rise, x + c, low + rise + d)
        passages = [box(a, low, far, low + width), box(far - width, low, far, low + rise)]
    return _Draft(shapely.union_all([first, last, *passages]), first, last, width)


def _door(random: Random, reach: float, narrowest: float) -> _Draft:
    """Two rooms with a wall and a door between them, and a pillar or two."""
    width = float(random.uniform(0.6, 1.5)) * narrowest
    a, c = random.uniform(1.9, 2.6, 2) * reach
    height = max(float(random.uniform(2.0, 2.6)) * reach, 1.2 * width)
    thick, low = float(random.uniform(0.05, 0.4)), float(random.uniform(0.0, height - width))
    first, last = box(0.0, 0.0, a, height), box(a + thick, 0.0, a + thick + c, height)
    floor = shapely.union_all([first, last, box(a, low, a + thick, low + width)])
    for _ in range(int(random.integers(3))):
        where = random.uniform((0.0, 0.0), (a + thick + c, height))
        floor = floor.difference(_blob(random, where, 0.12 * reach))
    return _Draft(floor, first, last, width)


def _warehouse(random: Random, reach: float, narrowest: float) -> _Draft:
    """Rows of shelves between aisles, from the first aisle to the last one."""
    aisle = float(random.uniform(1.0, 1.9)) * narrowest
    columns, rows = (int(value) for value in random.integers(2, 4 if random.random() < 0.7 else 10, 2))
    long, deep = random.uniform(0.4, 1.0) * reach, random.uniform(0.8, 2.0) * reach
    pitch = np.array([long + aisle, deep + aisle])
    length, width = pitch * (columns, rows) + aisle
    shelves = [
        box(x, y, x + long, y + deep)
        for i in range(columns)
        for j in range(rows)
        for x, y in [(aisle + i * pitch[0], aisle + j * pitch[1])]
        if random.random() < 0.92
    ]
    floor = box(0.0, 0.0, length, width).difference(shapely.union_all(shelves))
    return _Draft(floor, box(0.0, 0.0, aisle, width), box(length - aisle, 0.0, length, width), aisle)


def _rooms(random: Random, reach: float, narrowest: float) -> _Draft:
    """Four or six rooms with doors of one width, of which some are closed."""
    door, thick = float(random.uniform(0.8, 1.8)) * narrowest, float(random.uniform(0.05, 0.3))
    columns, rows = int(random.integers(2, 4)), 2
    size = np.maximum(random.uniform(1.7, 2.3, 2) * reach, 1.2 * door)
    pitch = size + thick
    places = [(i * pitch[0], j * pitch[1]) for i in range(columns) for j in range(rows)]
    open_parts = [box(x, y, x + size[0], y + size[1]) for x, y in places]
    first, last = open_parts[0], open_parts[-1]
    for x, y in places:
        along = random.uniform(0.0, size - door)
        to_right, upwards = random.random(2) < 0.85
        if to_right and x + 1.5 * pitch[0] < columns * pitch[0]:
            edge = x + size[0]
            open_parts.append(box(edge, y + along[1], edge + thick, y + along[1] + door))
        if upwards and y + 1.5 * pitch[1] < rows * pitch[1]:
            edge = y + size[1]
            open_parts.append(box(x + along[0], edge, x + along[0] + door, edge + thick))
    floor = shapely.union_all(open_parts)
    for _ in range(int(random.integers(4))):
        where = random.uniform((0.0, 0.0), pitch * (columns, rows))
        floor = floor.difference(_blob(random, where, 0.1 * reach))
    return _Draft(floor, first, last, door)


def _blob(random: Random, centre: np.ndarray, size: float) -> BaseGeometry:
    """A turned box or a convex polygon of up to twice some size across [m]."""
    if random.random() < 0.5:
        a, b = random.uniform(0.3, 1.0, 2) * size
        shape: BaseGeometry = affinity.rotate(box(-a, -b, a, b), float(random.uniform(0.0, 90.0)))
    else:
        shape = shapely.MultiPoint(random.uniform(-size, size, (6, 2))).convex_hull
    return affinity.translate(shape, *centre)


FLOORS: dict[str, Callable[[Random, float, float], _Draft]] = {
    "room": _room,
    "corridor": _corridor,
    "door": _door,
    "warehouse": _warehouse,
    "rooms": _rooms,
}
"""How to draw each kind of floor."""
