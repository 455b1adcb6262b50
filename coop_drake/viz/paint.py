"""Meshes and colours as Meshcat takes them."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat, Rgba

from coop_drake.drawing.colours import red_green_blue
from coop_drake.drawing.solids import TriangleMesh


def set_mesh(meshcat: Meshcat, path: str, mesh: TriangleMesh, colour: Rgba) -> None:
    """Put a triangle mesh at a path."""
    vertices, faces = (np.asfortranarray(rows.T) for rows in (mesh.vertices, mesh.faces))
    meshcat.SetTriangleMesh(path, vertices, faces, colour)


def rgba(colour: str, opacity: float = 1.0) -> Rgba:
    """Return a colour ``#rrggbb`` as Drake takes it."""
    return Rgba(*(part / 255 for part in red_green_blue(colour)), opacity)


def hex_colour(colour: Rgba) -> str:
    """Return a colour of Drake as ``#rrggbb``."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in (colour.r(), colour.g(), colour.b()))
