"""The object's trail: a ribbon on the floor that grows as the object moves."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat

from coop_drake.drawing.colours import INK
from coop_drake.drawing.solids import ribbon_mesh
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.paint import rgba, set_mesh

TRAIL_COLOUR = INK

STEP = 0.03
"""Length of the pieces of a trail [m]."""

INDICES = 6
"""Number of indices of vertices in the mesh of a piece: two triangles."""

_WIDTH, _HEIGHT = 0.035, 0.030
"""Width of the ribbon and its height above the floor [m]."""


def set_trail(meshcat: Meshcat, path: str, points: FloatArray) -> None:
    """Draw a part of the trail through points of shape (P, 2) [m]; fewer than two draw nothing."""
    if len(points) > 1:
        set_mesh(meshcat, path, ribbon_mesh(points, _WIDTH, _HEIGHT), rgba(TRAIL_COLOUR))


def trail_points(positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points at even distances along a path of the object, given at every frame, shape (F, 2) [m].

    Returns:
        The points, shape (P, 2) [m], and how many segments between them the object has passed at every frame,
        with fractions, shape (F,).
    """
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    pieces = int(np.ceil(gone[-1] / STEP))
    marks = np.linspace(0.0, gone[-1], pieces + 1)
    moving = np.concatenate([[True], np.diff(gone) > 0.0])
    points = np.column_stack([np.interp(marks, gone[moving], column[moving]) for column in positions.T])
    return points, gone / max(gone[-1], 1e-12) * pieces
