"""Distances between what is near each other along a path, and how they change with the configurations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.convex import following
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.tree.team_arrays import TeamArrays, moved, place

__all__ = ["Contacts", "body_contacts", "wall_contacts"]

_STEP = 1e-5
"""Step of the central differences of vertices [m or rad]: their errors are far below a micrometre."""

_LEAST_DISTANCE = 1e-9
"""Distances are divided by at least this [m]."""


class Contacts(NamedTuple):
    """Pairs of a vertex and an edge that are near each other, M of them.

    Attributes:
        rows: Sample of the path, shape (M,).
        distances: Distance between the bodies there, or of the body from the wall, shape (M,) [m].
        gradients: Its change per unit of each axis of z, shape (M, 3 + n).
    """

    rows: IntArray
    distances: FloatArray
    gradients: FloatArray


class _Vertices(NamedTuple):
    """All vertices of a team along a path of K samples, shapes (K, V, 2) and (K, V, 2, 3 + n)."""

    places: FloatArray
    changes: FloatArray


@compiled
def _places(team: TeamArrays, path: FloatArray) -> FloatArray:
    """Positions of all vertices in W, shape (K, V, 2) [m]."""
    places = np.empty((len(path), len(team.vertices), 2))
    for k in range(len(path)):
        poses = place(team, path[k])
        for piece in range(len(team.pieces)):
            X = poses[team.pieces[piece, 0]]
            for v in range(team.pieces[piece, 1], team.pieces[piece, 2]):
                x, y = moved(X[0], X[1], X[2], X[3], team.vertices[v, 0], team.vertices[v, 1])
                places[k, v, 0], places[k, v, 1] = x, y
    return places


def _vertices(team: TeamArrays, path: FloatArray) -> _Vertices:
    steps = _STEP * np.eye(path.shape[1])
    changes = [(_places(team, path + step) - _places(team, path - step)) / (2.0 * _STEP) for step in steps]
    return _Vertices(_places(team, path), np.stack(changes, axis=-1))


def wall_contacts(team: TeamArrays, path: FloatArray, edges: FloatArray, near: float) -> Contacts:
    """Vertices of the team near a wall, and corners of walls near an edge of the team.

    Args:
        team: The team.
        path: Free configurations, shape (K, 3 + n).
        edges: Edges (x0, y0, x1, y1) of the floor's closed rings, shape (E, 4) [m].
        near: Only distances below this one are listed [m].
    """
    vertices = _vertices(team, path)
    still = np.zeros((len(path), len(edges), 2, path.shape[1]))
    ends = (np.broadcast_to(edges[:, side], (len(path), len(edges), 2)) for side in ((0, 1), (2, 3)))
    first, last = (_Vertices(end, still) for end in ends)
    radii = _radii(team)
    ring = _ring_order(team)
    own = _Vertices(vertices.places[:, ring], vertices.changes[:, ring])
    return _joined(
        _contacts(vertices, first, last, radii[:, None], near),
        _contacts(first, vertices, own, radii[None, :], near),
    )


def body_contacts(team: TeamArrays, path: FloatArray, near: float) -> Contacts:
    """Vertices of bodies near an edge of another body that must not touch; see ``wall_contacts``."""
    vertices, ring, found = _vertices(team, path), _ring_order(team), []
    for one, other in (*team.pairs, *team.pairs[:, ::-1]):
        mine, theirs = np.arange(*team.pieces[one, 1:]), np.arange(*team.pieces[other, 1:])
        points, first, last = (
            _Vertices(vertices.places[:, rows], vertices.changes[:, rows])
            for rows in (mine, theirs, ring[theirs])
        )
        grown = np.full((1, 1), team.radii[one] + team.radii[other])
        found.append(_contacts(points, first, last, grown, near))
    none = Contacts(np.empty(0, np.int64), np.empty(0), np.empty((0, path.shape[1])))
    return _joined(none, *found)


def _contacts(
    points: _Vertices, first: _Vertices, last: _Vertices, grown: FloatArray, near: float
) -> Contacts:
    """Points near segments from first to last, whose distance is smaller by what the bodies are grown by."""
    a, along = first.places[:, None], (last.places - first.places)[:, None]
    squares = (along**2).sum(axis=-1)
    away = points.places[:, :, None] - a
    share = (away * along).sum(axis=-1) / np.where(squares > 0.0, squares, 1.0)
    share = np.clip(share, 0.0, 1.0)
    away = away - share[..., None] * along
    lengths = np.hypot(away[..., 0], away[..., 1])
    k, i, j = np.nonzero(lengths - grown < near)
    normals = away[k, i, j] / np.maximum(lengths[k, i, j], _LEAST_DISTANCE)[:, None]
    s = share[k, i, j][:, None, None]
    changes = points.changes[k, i] - (1.0 - s) * first.changes[k, j] - s * last.changes[k, j]
    distances = (lengths - grown)[k, i, j]
    return Contacts(k, distances, np.einsum("mc,mcd->md", normals, changes))


def _radii(team: TeamArrays) -> FloatArray:
    """What each vertex's piece is grown by, shape (V,) [m]."""
    counts = team.pieces[:, 2] - team.pieces[:, 1]
    grown: FloatArray = np.repeat(team.radii, counts)
    return grown


def _ring_order(team: TeamArrays) -> IntArray:
    """For each vertex the one that follows it in its piece, shape (V,)."""
    parts = [following(np.arange(first, last)) for _, first, last in team.pieces]
    return np.concatenate(parts).astype(np.int64)


def _joined(*contacts: Contacts) -> Contacts:
    return Contacts(*(np.concatenate(parts) for parts in zip(*contacts, strict=True)))
