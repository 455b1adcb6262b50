"""Meshes and colours as Meshcat takes them."""

from __future__ import annotations

from pydrake.geometry import Meshcat, Rgba

from coop_drake.drawing.solids import TriangleMesh

__all__ = ["hex_colour", "rgba", "set_mesh"]


def set_mesh(meshcat: Meshcat, path: str, mesh: TriangleMesh, colour: Rgba) -> None:
    """Put a triangle mesh at a path."""
    meshcat.SetTriangleMesh(path, mesh.vertices, mesh.faces, colour)


def rgba(colour: str, opacity: float = 1.0) -> Rgba:
    """Return a colour ``#rrggbb`` as Drake takes it."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return Rgba(red, green, blue, opacity)


def hex_colour(colour: Rgba) -> str:
    """Return a colour of Drake's as ``#rrggbb``."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in (colour.r(), colour.g(), colour.b()))
