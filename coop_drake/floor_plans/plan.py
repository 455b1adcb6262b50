"""A floor plan from another program as a workspace."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.errors import FloorPlanError
from coop_drake.extras import install_advice
from coop_drake.floor_plans.dxf_file import read_dxf
from coop_drake.floor_plans.map_file import OccupancyMap, read_map, room_of_map
from coop_drake.floor_plans.rooms import Inside, Room, chosen_room, room_of
from coop_drake.floor_plans.settings import FloorPlanSettings
from coop_drake.floor_plans.shape_file import read_geojson, read_wkt
from coop_drake.floor_plans.svg_file import read_svg
from coop_drake.floor_plans.walls import Drawing
from coop_drake.geometry.polygons import corners_of

# The floor-plan formats that can be read: to add one, write its reader and enter it in `READERS`.
#
# The formats are also listed for users: in the help of `cli/floor_plan.py`, in `scenario/model.py` (the key
# `file`; from it `python -m docs.generate` writes `docs/reference/scenario.md`), in `read_floor_plan` of
# `plan.py`, in the README and in `docs/how_to/floor_plan.md`.
#
# A reader takes the path of a file and the settings. It returns a `Drawing` (lines, each of them a wall;
# see `walls.py`) or an `OccupancyMap` (cells that are free or not; see `map_file.py`), and raises a
# `FloorPlanError` with place, finding and remedy where the file cannot be used. Everything after that, from
# gaps to corners, is shared.

READERS: Mapping[str, Callable[[Path, FloorPlanSettings], Drawing | OccupancyMap]] = {
    ".svg": read_svg,
    ".dxf": read_dxf,
    ".geojson": read_geojson,
    ".json": read_geojson,
    ".wkt": read_wkt,
    ".yaml": read_map,
    ".yml": read_map,
}
"""The reader of each format, by the suffix of the file's name in lower case."""

SUFFIXES = tuple(READERS)
"""Suffixes of the files that can be read."""


# Reads a floor plan of any format, and removes corners where that makes walls a little larger.

_LARGEST_FILE = 200_000_000
"""Larger files would fill the memory while they are read [bytes]."""
_MANY_DRAWN, _MANY_TRACED = 4_000, 300
"""Corners of a drawing and of a map from which a quick simplification goes before the exact one, whose work
grows with the square of their number. The quick one also takes a little off straight walls; the walls of a
map are rough in any case."""

_MOST_CORNERS = 20_000
"""Corners after the quick simplification from which the exact one would take minutes."""
_SPECK = 0.1
"""Other rooms smaller than this are not reported [m^2]."""
_ROUNDING = 1e-9
"""A floor may reach this far beyond the drawn one, by the rounding of coordinates [m]."""


@dataclass(frozen=True)
class FloorPlan:
    """A floor that was read from a file.

    Attributes:
        polygon: The floor with its holes, in W [m]; inside ``drawn`` up to a nanometre.
        drawn: The floor with every corner of the file [m].
        others: Areas of the file's other rooms, largest first [m^2].
        notes: Sentences about what was left out, joined or assumed.
    """

    polygon: Polygon
    drawn: Polygon
    others: tuple[float, ...]
    notes: tuple[str, ...]

    @property
    def corners(self) -> tuple[int, int]:
        """Number of corners of the floor, and of the floor as drawn."""
        return sum(map(len, corners_of(self.polygon))), sum(map(len, corners_of(self.drawn)))


def read_floor_plan(
    path: Path | str,
    settings: FloorPlanSettings | None = None,
    inside: Inside | tuple[float, float] | None = None,
) -> FloorPlan:
    """Read the room that holds a point from an SVG, DXF, GeoJSON or WKT file, or from an occupancy map.

    In drawings every line is a wall, in maps every cell that is not certainly free. The result lies inside
    the drawn floor: curves are enclosed from the floor's side, and corners are removed only where walls grow.

    Args:
        path: The file; its suffix says its format, ``.yaml`` for an occupancy map.
        settings: How the file is read.
        inside: A point of the room to read [m]; None for the largest room.

    Raises:
        FloorPlanError: The file cannot be read or used; with place, finding and remedy.
    """
    path, settings = Path(path), settings or FloorPlanSettings()
    inside = None if inside is None else Inside(*inside)
    file = str(path)
    settings.check(file)
    _check_file(path)
    try:
        with np.errstate(invalid="ignore", over="ignore"):  # such numbers are refused later, by name
            content = READERS[path.suffix.lower()](path, settings)
            room, notes, tolerance = _room(content, file, settings, inside)
    except ModuleNotFoundError as error:
        remedy = f"install what drawings need: {install_advice('ezdxf')}"
        raise FloorPlanError(file, "the reader", f"it needs the package {error.name}", remedy) from error
    except shapely.GEOSException as error:
        raise FloorPlanError(
            file, "the lines", f"they cannot be combined ({error})", "clean the drawing up, or choose layers"
        ) from error
    many = _MANY_TRACED if isinstance(content, OccupancyMap) else _MANY_DRAWN
    floor = _simplified(room.floor, tolerance, many, inside, file)
    if (stray := excess(floor, room.floor)) > _ROUNDING:
        raise FloorPlanError(
            file, "the floor", f"it would grow by {stray:.2g} m", "change the tolerance a little"
        )
    notes = (*notes, *room.notes)
    others = tuple(area for area in room.others if area >= _SPECK)
    return FloorPlan(floor, room.floor, others, notes)


def excess(floor: Polygon, drawn: Polygon) -> float:
    """How far a floor reaches beyond the drawn one [m]; zero if it lies inside."""
    if drawn.covers(floor):
        return 0.0
    outside = floor.difference(drawn)
    return float(shapely.distance(shapely.points(shapely.get_coordinates(outside)), drawn).max(initial=0.0))


def _check_file(path: Path) -> None:
    file = str(path)
    if path.suffix.lower() not in SUFFIXES:
        maps = path.suffix.lower() in (".pgm", ".png", ".bmp")
        remedy = "name the map's YAML file" if maps else f"use one of {', '.join(SUFFIXES)}"
        raise FloorPlanError(file, "the name", f"{path.suffix or 'no ending'!r} is no floor plan", remedy)
    try:
        size = path.stat().st_size
    except (OSError, ValueError) as error:
        raise FloorPlanError(file, "the file", f"it cannot be read ({error})", "check the path") from error
    if path.is_dir() or size == 0:
        raise FloorPlanError(file, "the file", "it is empty or a folder", "name a file with a drawing")
    if size > _LARGEST_FILE:
        raise FloorPlanError(
            file, "the file", f"{size / 1e6:.0f} MB", f"use at most {_LARGEST_FILE / 1e6:.0f} MB"
        )


def _room(
    content: Drawing | OccupancyMap, file: str, settings: FloorPlanSettings, inside: Inside | None
) -> tuple[Room, tuple[str, ...], float]:
    """The room as drawn, notes, and how far its walls may grow [m]."""
    if isinstance(content, Drawing):
        return room_of(content, file, settings.gap, inside), content.notes, settings.growth()
    growth, free = settings.growth(content.resolution), settings.unknown_is_free
    return room_of_map(content, file, inside, unknown_is_free=free, closing=growth), (), growth


def _simplified(drawn: Polygon, tolerance: float, many: int, inside: Inside | None, file: str) -> Polygon:
    """The floor with fewer corners, inside the drawn one; of several parts the one that holds the point."""
    from coop_drake.geometry.simplify import simplify_inward

    floor = simplify_inward(drawn, _ROUNDING)  # removes corners on straight edges
    corners = shapely.get_num_coordinates
    if tolerance > 0.0 and corners(floor) > many:
        # The floor is shrunk by as much as the new edges may lie off the old ones: none reaches a drawn wall.
        quick = 0.25 * tolerance
        shrunk = shapely.simplify(floor.buffer(-quick, join_style="mitre"), quick * (1.0 - 1e-6))
        parts = [part for part in shapely.get_parts(shrunk.buffer(0.0)) if part.area > 0.0]
        floor = chosen_room(parts, file, inside, Polygon()) if parts else floor
        tolerance *= 0.5
    if corners(floor) > _MOST_CORNERS:
        raise FloorPlanError(
            file,
            "the walls",
            f"{corners(floor):,} corners",
            "raise the tolerance, or leave out what are no walls",
        )
    if tolerance > 0.0:
        floor = simplify_inward(floor, tolerance)
    return shapely.orient_polygons(shapely.normalize(floor))
