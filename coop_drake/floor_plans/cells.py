"""Finds the room of an occupancy map that holds a point, and its exact outline along the edges of cells."""

from __future__ import annotations

import numpy as np
import shapely
from scipy import ndimage
from shapely import LineString, Polygon

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans.map_file import BoolGrid, OccupancyMap
from coop_drake.floor_plans.rooms import Inside, Room
from coop_drake.tree.pose import FloatArray


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
    """The cells of the room that discs inside the room cover (an opening); so walls only grow."""
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
