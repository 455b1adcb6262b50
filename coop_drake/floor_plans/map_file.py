"""Occupancy maps of ROS: their files, and their cells as a floor."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from math import cos, isfinite, sin
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import yaml
from numpy.typing import NDArray
from scipy import ndimage
from shapely import LineString, Polygon

from coop_drake.errors import FloorPlanError
from coop_drake.files import check_readable
from coop_drake.floor_plans.rooms import Inside, Room
from coop_drake.floor_plans.settings import FloorPlanSettings
from coop_drake.tree.arrays import FloatArray

# Reads ROS occupancy maps: a picture of cells, and a YAML file that says what its shades mean.

BoolGrid = NDArray[np.bool_]

_MODES = ("trinary", "scale", "raw")
_MOST_CELLS = 64_000_000
"""Larger pictures would fill the memory: a cell takes about 50 bytes while it is read."""
_LARGEST = 1.0
"""Largest description of a map [MB]; its picture stands in a file of its own."""
_REMEDY = "see the map_server's documentation for the file's keys"


@dataclass(frozen=True)
class OccupancyMap:
    """The cells of a map and their place in W.

    Attributes:
        free: Whether a cell is known to be free, shape (rows, columns); row 0 is the lowest.
        unknown: Whether a cell is neither known to be free nor known to be occupied, same shape.
        resolution: Edge of a cell [m].
        origin: Pose of the lower left corner of cell (0, 0) in W, (x, y, yaw) [m, rad].
    """

    free: BoolGrid
    unknown: BoolGrid
    resolution: float
    origin: tuple[float, float, float]

    def place(self, corners: FloatArray) -> FloatArray:
        """Points given in cells, (column, row), in W, shape (n, 2) [m]."""
        x, y, yaw = self.origin
        # No product of matrices: the order of its sums may differ, and equal points must stay equal to the
        # last bit.
        along, across = self.resolution * corners[:, 0], self.resolution * corners[:, 1]
        return np.column_stack(
            [x + cos(yaw) * along - sin(yaw) * across, y + sin(yaw) * along + cos(yaw) * across]
        )

    def cell(self, point: tuple[float, float]) -> tuple[int, int]:
        """Row and column of the cell that holds a point of W; both may be outside the map's array."""
        x, y, yaw = self.origin
        dx, dy = point[0] - x, point[1] - y
        column = (cos(yaw) * dx + sin(yaw) * dy) / self.resolution
        row = (-sin(yaw) * dx + cos(yaw) * dy) / self.resolution
        return int(np.floor(row)), int(np.floor(column))


def read_map(path: Path, settings: FloorPlanSettings) -> OccupancyMap:
    """Read the YAML file and the picture that it names.

    A cell that is neither certainly free nor certainly occupied is unknown, also where the modes ``scale``
    and ``raw`` give a probability.

    Args:
        path: The YAML file.
        settings: The scale multiplies the resolution and the origin.

    Raises:
        FloorPlanError: A key or the picture is missing or wrong, or a setting is for drawings only.
    """
    file, scale = str(path), settings.scale
    for key in ("unit", "layers"):
        if getattr(settings, key):
            raise FloorPlanError(file, key, "an occupancy map has none", f"leave {key} away")
    document = _document(path)
    resolution = _number(document, "resolution", file) * scale
    if not 0.0 < resolution <= 10.0:
        raise FloorPlanError(
            file, "resolution", f"cells of {resolution:g} m are not allowed", "give metres per cell"
        )
    origin = document.get("origin")
    if not (isinstance(origin, list) and len(origin) == 3 and all(_is_number(value) for value in origin)):
        raise FloorPlanError(file, "origin", f"{origin!r} is no pose", "give [x, y, yaw] in m and rad")
    mode = document.get("mode", "trinary")
    if mode not in _MODES:
        raise FloorPlanError(file, "mode", f"{mode!r} is unknown", f"use one of {', '.join(_MODES)}")
    shades, opaque = _picture(path, document)
    free, occupied = _judged(document, mode, shades, file)
    free, occupied = free & opaque, occupied & opaque
    unknown = ~(free | occupied)
    pose = (float(origin[0]) * scale, float(origin[1]) * scale, float(origin[2]))
    return OccupancyMap(free[::-1], unknown[::-1], resolution, pose)


def _document(path: Path) -> dict[str, Any]:
    file = str(path)
    try:
        document = yaml.safe_load(check_readable(path, _LARGEST).read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError, ValueError, RecursionError) as error:
        finding = f"no YAML ({' '.join(str(error).split())[:200]})"
        raise FloorPlanError(file, "the file", finding, _REMEDY) from error
    if not isinstance(document, dict):
        raise FloorPlanError(file, "the file", "it holds no keys", _REMEDY)
    return document


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e6


def _number(document: dict[str, Any], key: str, file: str, default: float | None = None) -> float:
    value = document.get(key, default)
    if isinstance(value, str):  # YAML 1.1 takes 5e-2 for a text.
        try:
            value = float(value)
        except ValueError:
            value = None
    if not _is_number(value) or value is None or not isfinite(value):
        raise FloorPlanError(file, key, f"{document.get(key)!r} is no number", "give a finite number")
    return float(value)


def _judged(document: dict[str, Any], mode: str, shades: FloatArray, file: str) -> tuple[BoolGrid, BoolGrid]:
    """Which cells are certainly free and which are certainly occupied, each of shape (rows, columns)."""
    negate = document.get("negate", 0)
    if negate not in (0, 1):
        raise FloorPlanError(file, "negate", f"{negate!r} is neither 0 nor 1", "use 0 or 1")
    occupied_from = _number(document, "occupied_thresh", file, 0.65)
    free_below = _number(document, "free_thresh", file, 0.196)
    if not 0.0 <= free_below <= occupied_from <= 1.0:
        raise FloorPlanError(
            file,
            "free_thresh",
            f"{free_below:g} and occupied_thresh {occupied_from:g} do not part the shades",
            "use 0 <= free_thresh <= occupied_thresh <= 1",
        )
    if mode == "raw":
        percent = np.rint(255.0 * shades)
        return percent < 100.0 * free_below, (percent > 100.0 * occupied_from) & (percent <= 100.0)
    occupancy = shades if negate else 1.0 - shades
    return occupancy < free_below, occupancy > occupied_from


def _picture(path: Path, document: dict[str, Any]) -> tuple[FloatArray, BoolGrid]:
    """Shades from 0 to 1, and which cells are opaque, shape (rows, columns), the top row first."""
    from PIL import Image, UnidentifiedImageError

    file = str(path)
    name = document.get("image")
    if not isinstance(name, str) or not name:
        raise FloorPlanError(file, "image", f"{name!r} names no picture", "name the picture beside the file")
    picture = path.parent / name
    if not picture.is_file():
        raise FloorPlanError(file, "image", f"there is no {picture}", "put the picture beside the file")
    try:
        with warnings.catch_warnings(), Image.open(picture) as image:
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            if image.width * image.height > _MOST_CELLS:
                finding = f"{image.width} by {image.height} cells"
                raise FloorPlanError(str(picture), "the size", finding, f"use at most {_MOST_CELLS:,} cells")
            return _shades(image)
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        finding = f"no readable picture ({error}); it may be cut short"
        raise FloorPlanError(str(picture), "the picture", finding, "save it anew as PGM or PNG") from error


def _shades(image: Any) -> tuple[FloatArray, BoolGrid]:
    if image.mode.startswith("I"):
        shades = np.asarray(image, dtype=float) / 65535.0
        return shades, np.ones(shades.shape, dtype=bool)
    if image.mode in ("L", "1"):
        shades = np.asarray(image.convert("L"), dtype=float) / 255.0
        return shades, np.ones(shades.shape, dtype=bool)
    channels = np.asarray(image.convert("RGBA"), dtype=float)
    return channels[..., :3].mean(axis=-1) / 255.0, channels[..., 3] == 255.0


# Finds the room of an occupancy map that holds a point, and its exact outline along the edges of cells.


def room_of_map(
    cells: OccupancyMap, file: str, inside: Inside | None, *, unknown_is_free: bool, closing: float
) -> Room:
    """Find the room of connected free cells; cells that touch only at a corner are not connected.

    Args:
        cells: The map.
        file: For messages.
        inside: A point of the room to find; None for the largest.
        unknown_is_free: Whether unknown cells count as floor.
        closing: Radius of a disc; places into which it does not fit become walls [m].

    Raises:
        FloorPlanError: Nothing is free, or the point stands on no free cell.
    """
    free = cells.free | cells.unknown if unknown_is_free else cells.free
    free = np.pad(free, 1)  # Everything outside the map is wall.
    notes = []
    if not unknown_is_free and cells.unknown.any():
        notes.append(f"{int(cells.unknown.sum())} unknown cells count as walls")
    room, others = _component(free, cells, file, inside)
    radius = closing / cells.resolution
    opened = room if radius < 1.0 else _opened(room, radius)
    opened = _without_checkers(opened)
    room, _ = _component(opened, cells, file, inside)
    areas = tuple(cells.resolution**2 * count for count in others)
    return Room(_outline(room, cells), areas, tuple(notes))


def _component(
    free: BoolGrid, cells: OccupancyMap, file: str, inside: Inside | None
) -> tuple[BoolGrid, list[int]]:
    """The connected cells around a point, or the most cells; and how many the others have, descending."""
    labels, count = ndimage.label(free)
    if count == 0:
        raise FloorPlanError(
            file, "the picture", "no cell is free", "check negate and free_thresh, or allow unknown cells"
        )
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    sizes[0] = 0
    label = int(sizes.argmax())
    if inside is not None:
        row, column = (index + 1 for index in cells.cell((inside.x, inside.y)))
        within = 0 <= row < labels.shape[0] and 0 <= column < labels.shape[1]
        label = int(labels[row, column]) if within else 0
    if label == 0 and inside is not None:
        width, height = np.subtract(free.shape[::-1], 2)
        corners = cells.place(np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]))
        (x, y), (right, top) = corners.min(axis=0), corners.max(axis=0)
        raise FloorPlanError(
            file,
            str(inside),
            "it stands on no free cell",
            f"the map reaches from ({x:.4g}, {y:.4g}) to ({right:.4g}, {top:.4g}) m; move the point, or mend "
            "origin and thresholds",
        )
    rest = np.delete(sizes, [0, label])
    return labels == label, sorted((int(size) for size in rest), reverse=True)


def _opened(room: BoolGrid, radius: float) -> BoolGrid:
    """Return the cells that lie in a disc inside the room (a morphological opening): walls only grow."""
    centres = ndimage.distance_transform_edt(room) > radius
    return (ndimage.distance_transform_edt(~centres) <= radius) & room


def _without_checkers(room: BoolGrid) -> BoolGrid:
    """The room without cells that touch another at a corner only, where its outline would touch itself."""
    while True:
        a, b, c, d = room[:-1, :-1], room[:-1, 1:], room[1:, :-1], room[1:, 1:]
        falling, rising = a & d & ~b & ~c, b & c & ~a & ~d
        if not (falling | rising).any():
            return room
        room = room.copy()
        room[:-1, :-1] &= ~falling
        room[1:, 1:] &= ~falling
        room[:-1, 1:] &= ~rising
        room[1:, :-1] &= ~rising


def _outline(room: BoolGrid, cells: OccupancyMap) -> Polygon:
    """The union of the cells' squares, from the edges between room and wall."""
    edges = np.vstack([_runs(room), _runs(room.T)[:, :, ::-1]])
    placed = cells.place((edges - 1.0).reshape(-1, 2)).reshape(-1, 2, 2)
    faces: list[Polygon] = list(shapely.get_parts(shapely.polygonize([LineString(edge) for edge in placed])))
    # The room is connected and its outline does not touch itself: only its face spans all edges.
    outline = max(faces, key=lambda face: shapely.box(*face.bounds).area)
    return shapely.orient_polygons(outline)


def _runs(room: BoolGrid) -> FloatArray:
    """Straight edges between room and wall along rows, each as two (column, row), shape (n, 2, 2)."""
    change = np.diff(room.astype(np.int8), axis=0)
    padded = np.pad(change, ((0, 0), (1, 1)))
    steps = np.diff(padded, axis=1) != 0
    row, column = np.nonzero(steps)
    value = padded[row, column + 1]
    begins = value != 0
    ends = padded[row, column] != 0
    starts = np.column_stack([column[begins], row[begins] + 1])
    stops = np.column_stack([column[ends], row[ends] + 1])
    return np.stack([starts, stops], axis=1).astype(float)
