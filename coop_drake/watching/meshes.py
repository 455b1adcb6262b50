"""Triangles of slabs and tubes; vertices shared, so that pages stay small."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from manifold3d import CrossSection
from numpy.typing import NDArray

from coop_drake.tree.pose import FloatArray

__all__ = ["Triangles", "joined", "prism", "tube"]

Triangles = tuple[FloatArray, NDArray[np.int64]]
"""Vertices of shape (v, 3) and faces of shape (f, 3), indices of vertices."""

_CORNERS = 6  # Corners of a tube's cross-section.


def prism(section: CrossSection, low: float, high: float, *, coarse: float) -> Triangles:
    """A section from one height to another.

    Args:
        section: Positions, not empty [m].
        low: Height of its bottom.
        high: Height of its top.
        coarse: What outlines may move by when they are straightened [m].
    """
    simpler = section.simplify(coarse)
    solid = (section if simpler.is_empty() else simpler).extrude(high - low).translate((0.0, 0.0, low))
    mesh = solid.to_mesh()
    return np.asarray(mesh.vert_properties, dtype=float)[:, :3], np.asarray(mesh.tri_verts, dtype=np.int64)


def tube(points: FloatArray, radius: float) -> Triangles:
    """Straight pieces of tube from point to point; NaN breaks it; shape (k, 3)."""
    pieces = [
        _piece(a, b, radius)
        for a, b in pairwise(points)
        if np.linalg.norm(b - a) > 1e-9  # False for NaN, too.
    ]
    return joined(pieces)


def joined(meshes: Iterable[Triangles]) -> Triangles:
    """Several meshes as one."""
    vertices, faces, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0
    for points, triangles in meshes:
        vertices.append(points)
        faces.append(triangles + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def _piece(a: FloatArray, b: FloatArray, radius: float) -> Triangles:
    along = (b - a) / np.linalg.norm(b - a)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    turns = np.arange(_CORNERS) * (2.0 * np.pi / _CORNERS)
    ring = radius * (np.outer(np.cos(turns), across) + np.outer(np.sin(turns), np.cross(along, across)))
    i = np.arange(_CORNERS)
    j = (i + 1) % _CORNERS
    faces = np.concatenate(
        [np.column_stack([i, j, j + _CORNERS]), np.column_stack([i, j + _CORNERS, i + _CORNERS])]
    )
    # Pieces reach a little into each other, so that bends have no notch.
    reach = 0.5 * radius * along
    return np.concatenate([a - reach + ring, b + reach + ring]), faces
