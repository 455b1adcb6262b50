"""Compiled under-sweeps: intersections of half-planes or discs, rounded inwards; no rows where empty."""

from __future__ import annotations

from math import cos, floor, pi, sin, sqrt

import numpy as np

from coop_drake.geometry.sweeps import SLACK
from coop_drake.geometry.sweeps import arc_parts, closed_directions, edge_directions, support
from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray

_TURN = 2.0 * pi

_SAME_ANGLE = 1e-12
"""Lines whose normals differ by less count as parallel, and the inner one is kept [rad]."""

_PARALLEL = 1e-12
"""Lines whose normals have a smaller sine between them count as parallel [-]."""

_SHORTEST = 1e-9
"""Shorter edges are left out [m]: they are within the rounding ``SLACK``."""


@compiled
def half_planes_polygon(angles: FloatArray, offsets: FloatArray) -> FloatArray:
    """Intersection of half-planes that bound a polygon, rounded inwards by ``SLACK``.

    Line i keeps the stretch between the largest of its lower and the smallest of its upper crossings with
    all the others.

    Args:
        angles: Directions of the outward normals, shape (k,) [rad].
        offsets: Signed distances of the lines from the origin, shape (k,) [m].

    Returns:
        Vertices, counter-clockwise, shape (m, 2); no rows where the intersection has no interior.
    """
    x, y, h, turned = (
        np.empty(len(angles)),
        np.empty(len(angles)),
        np.empty(len(angles)),
        np.empty(len(angles)),
    )
    count = 0
    for i in range(len(angles)):
        angle, offset = angles[i] - _TURN * floor(angles[i] / _TURN), offsets[i] - SLACK
        k = count
        while k > 0 and turned[k - 1] > angle:
            turned[k], h[k] = turned[k - 1], h[k - 1]
            k -= 1
        turned[k], h[k] = angle, offset
        count += 1
    lines, count = count, 0
    for i in range(lines):
        if count > 0 and turned[i] - turned[count - 1] <= _SAME_ANGLE:
            h[count - 1] = min(h[count - 1], h[i])
            continue
        turned[count], h[count] = turned[i], h[i]
        x[count], y[count] = cos(turned[i]), sin(turned[i])
        count += 1
    vertices = np.empty((count, 2))
    size = 0
    for i in range(count):
        lower, upper = -np.inf, np.inf
        for j in range(count):
            sine = x[i] * y[j] - y[i] * x[j]
            left = h[j] - h[i] * (x[i] * x[j] + y[i] * y[j])
            if abs(sine) < _PARALLEL:
                if left < -_PARALLEL:
                    upper = -np.inf
            elif sine > 0.0:
                upper = min(upper, left / sine)
            else:
                lower = max(lower, left / sine)
        if upper - lower > _SHORTEST:
            vertices[size, 0], vertices[size, 1] = h[i] * x[i] - upper * y[i], h[i] * y[i] + upper * x[i]
            size += 1
    return vertices[: size if size >= 3 else 0]


@compiled
def shrunk(vertices: FloatArray, distance: float) -> FloatArray:
    """Find points that keep a distance from the boundary of a convex polygon.

    Args:
        vertices: Convex ring, counter-clockwise, shape (n, 2) [m].
        distance: The distance [m].

    Returns:
        Vertices of a convex polygon, shape (m, 2); no rows where it has no interior.
    """
    angles = edge_directions(vertices)
    found: FloatArray = half_planes_polygon(angles, support(vertices, angles) - distance)
    return found


@compiled
def under_revolute(vertices: FloatArray, centre: float, half_width: float) -> FloatArray:
    """Find points that a convex polygon covers at every angle of an interval about the origin.

    Every half-plane becomes its two extreme turns and, where it holds the pivot, chords of the circle that
    it envelops. A half-plane without the pivot and a turn by pi or more have no common points.

    Args:
        vertices: Convex ring, counter-clockwise, shape (n, 2) [m].
        centre: Middle of the interval [rad].
        half_width: Half of its width [rad].

    Returns:
        Vertices of an enclosed convex polygon, shape (m, 2); no rows where none was found.
    """
    half_width = min(half_width, pi)  # A joint of many turns covers no more; its chords would leap over arcs.
    edges = edge_directions(vertices)
    offsets = support(vertices, edges)
    parts = arc_parts(half_width)
    half_chord = half_width / parts
    angles, distances = np.empty(len(edges) * (2 + parts)), np.empty(len(edges) * (2 + parts))
    size = 0
    for i in range(len(edges)):
        angle, offset = edges[i], offsets[i]
        if offset <= 0.0 and half_width >= 0.5 * pi:
            return np.empty((0, 2))
        for side in (-1.0, 1.0):
            angles[size], distances[size] = centre + angle + side * half_width, offset
            size += 1
        for part in range(parts if offset > 0.0 else 0):
            angles[size] = centre + angle + half_chord * (2.0 * part + 1.0 - parts)
            distances[size] = offset * cos(half_chord)
            size += 1
    return half_planes_polygon(angles[:size], distances[:size])


@compiled
def under_prismatic(vertices: FloatArray, x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    """Find points that a convex polygon covers at every displacement from (x0, y0) to (x1, y1) [m].

    They are the points that both end copies cover; no rows where there are none. The ring is
    counter-clockwise, shape (n, 2) [m].
    """
    angles = edge_directions(vertices)
    offsets = support(vertices, angles)
    for k in range(len(angles)):
        x, y = cos(angles[k]), sin(angles[k])
        offsets[k] += min(x * x0 + y * y0, x * x1 + y * y1)
    return half_planes_polygon(angles, offsets)


@compiled
def common_disc(centres: FloatArray, radius: float, largest_turn: float) -> FloatArray:
    """Polygon inside every disc of one radius [m] whose centre lies in a convex polygon, shape (n, 2) [m].

    A point is within the radius of every centre if it is of every vertex; from their middle each ray leaves
    the common part at the nearest exit. Neighbouring vertices of the result are ``largest_turn`` apart [rad];
    it has no rows where the discs have no common part.
    """
    low_x, low_y, high_x, high_y = np.inf, np.inf, -np.inf, -np.inf
    for i in range(len(centres)):
        low_x, high_x = min(low_x, centres[i, 0]), max(high_x, centres[i, 0])
        low_y, high_y = min(low_y, centres[i, 1]), max(high_y, centres[i, 1])
    x, y = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y)
    directions = closed_directions(np.empty(0), largest_turn)
    ring = np.empty((len(directions), 2))
    for k in range(len(directions)):
        u, v = cos(directions[k]), sin(directions[k])
        reach = np.inf
        for i in range(len(centres)):
            dx, dy = x - centres[i, 0], y - centres[i, 1]
            beyond = radius * radius - dx * dx - dy * dy
            if beyond <= 0.0:
                return np.empty((0, 2))
            along = u * dx + v * dy
            reach = min(reach, sqrt(along * along + beyond) - along)
        reach *= 1.0 - 1e-9
        ring[k, 0], ring[k, 1] = x + reach * u, y + reach * v
    return ring
