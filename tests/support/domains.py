"""Domains to map: corridors, rooms with shelves, cells with needles and slits."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from shapely import Point, Polygon, affinity, box


def square() -> tuple[Polygon, Point]:
    return box(0, 0, 1, 1), Point(0.3, 0.6)


def u_corridor() -> tuple[Polygon, Point]:
    ring = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
    return Polygon(ring), Point(0.5, 2.5)


def warehouse() -> tuple[Polygon, Point]:
    """28 vertices, six shelves."""
    shelves = [
        box(1 + 2.2 * i, 1 + 2.5 * j, 2.4 + 2.2 * i, 1.8 + 2.5 * j) for i in range(3) for j in range(2)
    ]
    return box(0, 0, 8, 6).difference(shapely.union_all(shelves)), Point(7.3, 5.3)


def maze(corridors: int = 8) -> tuple[Polygon, Point]:
    """A serpentine with thin walls."""
    walls = [
        box(i - 0.1, -1, i + 0.1, 5.2) if i % 2 else box(i - 0.1, 0.8, i + 0.1, 7)
        for i in range(1, corridors)
    ]
    return box(0, 0, corridors, 6).difference(shapely.union_all(walls)), Point(corridors - 0.4, 0.5)


def needle(degrees: float) -> tuple[Polygon, Point]:
    """A square with a needle of the given interior angle."""
    tip = -0.1 / np.tan(np.deg2rad(degrees) / 2)
    return box(0, 0, 2, 2).union(Polygon([(0, 0.9), (0, 1.1), (tip, 1)])), Point(1.2, 0.7)


def blade(degrees: float) -> tuple[Polygon, Point]:
    """A square with a wedge cut in, of the given interior angle at its tip."""
    half = 2 * np.tan(np.deg2rad(360 - degrees) / 2)
    return box(0, 0, 2, 2).difference(Polygon([(1, 1), (-1, 1 - half), (-1, 1 + half)])), Point(1.5, 0.7)


def two_rooms(neck: float) -> tuple[Polygon, Point]:
    """Two square rooms and a door of the given width."""
    door = box(0.99, 0.5 - neck / 2, 1.11, 0.5 + neck / 2)
    return shapely.union_all([box(0, 0, 1, 1), door, box(1.1, 0, 2, 1)]), Point(1.6, 0.4)


def bevelled(edge: float) -> tuple[Polygon, Point]:
    """A square with one corner cut off by a tiny edge."""
    return Polygon([(edge, 0), (1, 0), (1, 1), (0, 1), (0, edge)]), Point(0.6, 0.5)


def rounded_room() -> tuple[Polygon, Point]:
    """Many nearly straight vertices and many edges of almost the same length."""
    return shapely.box(0, 0, 3, 2).difference(shapely.box(1.4, 1, 1.6, 3)).buffer(-0.3, quad_segs=8), Point(
        0.6, 1.2
    )


def random_room(rng: np.random.Generator, holes: int) -> Polygon:
    """A star-shaped room with up to so many random obstacles in it."""
    room = _star(rng, int(rng.integers(5, 12)), 0.6, 1.6)
    for _ in range(holes):
        obstacle = affinity.translate(
            _star(rng, int(rng.integers(3, 7)), 0.05, 0.25), *rng.uniform(-0.8, 0.8, 2)
        )
        if room.buffer(-0.02).contains(obstacle):
            room = room.difference(obstacle)
    return room


def _star(rng: np.random.Generator, count: int, shortest: float, longest: float) -> Polygon:
    angle = 2 * np.pi * (np.arange(count) + rng.uniform(-0.35, 0.35, count)) / count
    radius = rng.uniform(shortest, longest, count)
    return Polygon(np.column_stack((radius * np.cos(angle), radius * np.sin(angle))))


def off_wall(region: Polygon, distance: float, per_edge: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """Points at a distance from the walls, between the corners, and the inward normals there."""
    points, normals = [], []
    oriented = shapely.orient_polygons(region)
    part = np.linspace(0.1, 0.9, per_edge)[:, None]
    for ring in (oriented.exterior, *oriented.interiors):
        v = np.asarray(ring.coords)
        for a, b in pairwise(v):
            normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
            points.append(a + part * (b - a) + distance * normal)
            normals.append(np.broadcast_to(normal, (per_edge, 2)))
    return np.concatenate(points), np.concatenate(normals)


def inside(region: Polygon, count: int, *, clearance: float = 0.0, seed: int = 0) -> np.ndarray:
    """Random interior points, shape (<= count, 2)."""
    points = np.random.default_rng(seed).uniform(region.bounds[:2], region.bounds[2:], (count, 2))
    core = region.buffer(-clearance)
    return points[shapely.contains_xy(core, *points.T)]
