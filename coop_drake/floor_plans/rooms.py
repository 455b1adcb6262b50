"""Rooms between walls, and the gaps through which they leak."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely
from shapely import LinearRing, LineString, Point, Polygon, STRtree
from shapely.geometry.base import BaseGeometry
from shapely.validation import explain_validity

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans.walls import Drawing, Wall
from coop_drake.tree.arrays import FloatArray

# Joins loose ends of lines to lines that they nearly touch: this adds walls and removes none.


def loose_ends(noded: BaseGeometry) -> FloatArray:
    """Points at which exactly one line ends and no other passes, in order, shape (n, 2) [m].

    The lines, ``noded``, meet at their ends only.
    """
    lines = shapely.get_parts(noded)
    ends = np.vstack([shapely.get_coordinates(shapely.get_point(lines, at)) for at in (0, -1)])
    points, counts = np.unique(ends, axis=0, return_counts=True)
    loose: FloatArray = points[counts == 1]
    return loose


def bridges(noded: BaseGeometry, gap: float) -> list[LineString]:
    """Shortest lines from loose ends to other lines, none longer than the gap [m].

    A loose end goes to the nearest other one if there is one within the gap, otherwise to the nearest line.
    The lines, ``noded``, meet at their ends only.
    """
    ends = loose_ends(noded)
    if not len(ends) or gap <= 0.0:
        return []
    segments = _segments(noded)
    points = [Point(end) for end in ends]
    to_ends, to_segments = STRtree(points), STRtree(segments)
    found = []
    for place, point in enumerate(points):
        near = [other for other in to_ends.query(point, "dwithin", gap).tolist() if other != place]
        if near:
            best = min(near, key=lambda other: (point.distance(points[other]), other))
            found.append(LineString([point, points[best]]))
            continue
        bridge = _to_line(point, [segments[at] for at in sorted(to_segments.query(point, "dwithin", gap))])
        if bridge is not None:
            found.append(bridge)
    return [bridge for bridge in found if bridge.length > 0.0]


def _segments(noded: BaseGeometry) -> list[LineString]:
    """All straight pieces of the lines."""
    pieces = []
    for line in shapely.get_parts(noded):
        coordinates = shapely.get_coordinates(line)
        pieces += [
            LineString(pair) for pair in np.stack([coordinates[:-1], coordinates[1:]], axis=1) if len(pair)
        ]
    return pieces


def _to_line(point: Point, segments: list[LineString]) -> LineString | None:
    """The shortest bridge from a loose end to a line that it does not stand on, a little beyond it."""
    others = [segment for segment in segments if segment.distance(point) > 0.0]
    if not others:
        return None
    nearest = min(others, key=lambda segment: float(segment.distance(point)))
    foot = shapely.get_coordinates(shapely.shortest_line(point, nearest))[1]
    start = shapely.get_coordinates(point)[0]
    return LineString([start, foot + 1e-6 * (foot - start) / np.hypot(*(foot - start))])


# Finds the rooms that the walls of a drawing enclose, and chooses one of them.

_LARGEST = 1000.0
_SMALLEST = 0.1
"""Floors wider or narrower than this are refused, since the unit is probably wrong [m]."""

_THINNEST = 1e-3
"""Half the thickness that a line gets which ends freely inside a room [m]."""

_LARGEST_COORDINATE = 1e6
"""Larger coordinates are refused; they would leave too few digits for millimetres [m]."""
_MANY_ENDS = 1000
"""Loose ends among which the closest two are looked for, in a table of their squared number."""


class Inside(NamedTuple):
    """A point in W that says which room to read.

    Attributes:
        x: [m].
        y: [m].
        called: Its name in messages.
    """

    x: float
    y: float
    called: str = "the point"

    def __str__(self) -> str:
        return f"{self.called} ({self.x:g}, {self.y:g})"


@dataclass(frozen=True)
class Room:
    """One room of a plan.

    Attributes:
        floor: The area that its walls leave free, in W [m].
        others: Areas of the plan's other rooms, largest first [m^2].
        notes: Sentences about what was done to the lines.
    """

    floor: Polygon
    others: tuple[float, ...]
    notes: tuple[str, ...]


def room_of(drawing: Drawing, file: str, gap: float, inside: Inside | None) -> Room:
    """Find a room of a drawing, with every line as a wall.

    Args:
        drawing: All lines with their half widths.
        file: For messages.
        gap: Lines that end this close to another line are joined to it [m].
        inside: A point of the room to find; None for the largest.

    Raises:
        FloorPlanError: Nothing is enclosed, an outline crosses itself, the point lies in a wall or outside,
            or the size is no floor's.
    """
    if not drawing.walls:
        raise FloorPlanError(
            file, "the drawing", "it holds no line", "choose other layers, or convert texts and pictures"
        )
    for wall in drawing.walls:
        _check(wall, file)
    _check_size(drawing, file)
    solid = shapely.union_all([wall.body for wall in drawing.walls if wall.half_width > 0.0])
    lines = [wall.body for wall in drawing.walls if wall.half_width == 0.0]
    noded = shapely.unary_union([*lines, solid.boundary])
    joined = bridges(noded, gap)
    if joined:
        noded = shapely.unary_union([noded, *joined])
    faces, cuts, dangles, _ = shapely.polygonize_full(shapely.get_parts(noded))
    rooms = [face for face in shapely.get_parts(faces) if not solid.contains(face.representative_point())]
    if not rooms:
        raise _nothing_closed(noded, file, gap)
    room = chosen_room(rooms, file, inside, solid)
    loose: Any = [cuts, dangles]
    free = shapely.union_all(loose).intersection(room)
    floor = room
    if not free.is_empty and free.length > 0.0:
        parts = shapely.get_parts(room.difference(free.buffer(_THINNEST, join_style="mitre")))
        floor = chosen_room([part for part in parts if isinstance(part, Polygon)], file, inside, solid)
    outline = Polygon(room.exterior)  # Faces inside this outline are obstacles, not rooms.
    places = [other for other in rooms if other is not room and not outline.covers(other)]
    others = sorted((float(other.area) for other in places), reverse=True)
    notes = [f"{len(joined)} gaps of up to {gap:g} m were closed"] if joined else []
    if not free.is_empty and free.length > 0.0:
        notes.append(f"lines that enclose nothing stand as walls of {2e3 * _THINNEST:g} mm")
    return Room(shapely.orient_polygons(floor), tuple(others), tuple(notes))


def chosen_room(rooms: list[Polygon], file: str, inside: Inside | None, solid: BaseGeometry) -> Polygon:
    """The room that holds a point, or the largest.

    Raises:
        FloorPlanError: No room holds the point.
    """
    if inside is None:
        return max(rooms, key=lambda room: (room.area, room.bounds))
    point = Point(inside.x, inside.y)
    for room in rooms:
        if room.contains(point):
            return room
    where = "in a wall" if solid.intersects(point) else "in none of the enclosed places"
    largest = max(rooms, key=lambda room: room.area)
    x, y, right, top = largest.bounds
    raise FloorPlanError(
        file,
        str(inside),
        f"it stands {where}",
        f"the largest place reaches from ({x:.3g}, {y:.3g}) to ({right:.3g}, {top:.3g}) m; move the point, "
        "or mend unit, scale or outlines",
    )


def _check(wall: Wall, file: str) -> None:
    points = wall.points
    if not (np.isfinite(points).all() and np.abs(points).max(initial=0.0) <= _LARGEST_COORDINATE):
        finding = "coordinates that are not finite, or beyond a thousand kilometres"
        raise FloorPlanError(file, wall.place, finding, "delete it, or mend the unit")
    if not (wall.closed and len(np.unique(points, axis=0)) > 2):
        return
    ring = LinearRing(points)
    if not ring.is_simple:
        reason = explain_validity(Polygon(points))
        at = reason.partition("[")[2].rstrip("]").split()
        where = f" at ({float(at[0]):.6g}, {float(at[1]):.6g}) m" if len(at) >= 2 else ""
        raise FloorPlanError(
            file, wall.place, f"the outline crosses or touches itself{where}", "draw it without crossings"
        )


def _check_size(drawing: Drawing, file: str) -> None:
    points = np.vstack([wall.points for wall in drawing.walls])
    width, height = np.ptp(points, axis=0)
    size = max(width, height)
    if not _SMALLEST <= size <= _LARGEST:
        raise FloorPlanError(
            file,
            "the drawing",
            f"it is {width:.4g} m by {height:.4g} m, which cannot be a floor",
            f"mend unit or scale; {_SMALLEST:g} m to {_LARGEST:g} m are allowed",
        )


def _nothing_closed(noded: BaseGeometry, file: str, gap: float) -> FloorPlanError:
    """The error that says where the outline is open."""
    ends = loose_ends(noded)[:_MANY_ENDS]
    if len(ends) < 2:
        return FloorPlanError(
            file, "the drawing", "its lines enclose nothing", "draw an outline that ends where it begins"
        )
    apart = np.hypot(*(ends[:, None] - ends[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    first, second = np.unravel_index(int(apart.argmin()), apart.shape)
    a, b = ends[first], ends[second]
    return FloorPlanError(
        file,
        f"({a[0]:.6g}, {a[1]:.6g})",
        f"no outline is closed; this end lies {apart[first, second]:.3g} m from the one at "
        f"({b[0]:.6g}, {b[1]:.6g})",
        f"close it in the drawing, or allow a gap of more than that (it is {gap:g} m)",
    )
