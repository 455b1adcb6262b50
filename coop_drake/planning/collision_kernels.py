"""Compiled exact checks of single configurations: they steer the sampler and prove nothing."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from coop_drake.geometry.convex import edge_angles, following, normals
from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.tree import ComponentTree, ConvexShape

IntArray = NDArray[np.int64]


class TeamArrays(NamedTuple):
    """A component tree as arrays, C components, P convex pieces, V vertices in all.

    Attributes:
        parent: Parent component, -1 for the object's, shape (C,).
        axis: Place of the joint's value in z, shape (C,).
        turning: 1 for revolute joints, 0 for prismatic ones, shape (C,).
        joint: X_PJ as (x, y, angle), sign, and axis in J, shape (C, 6).
        reach: Radius of a disc about the component's origin that holds it, shape (C,).
        owner: Component of each piece, shape (P,).
        first: Where each piece's vertices begin, shape (P + 1,).
        vertices: Vertices in the component's frame, shape (V, 2).
        normals: Outward normals of the edges that start at them, shape (V, 2).
        offsets: Their distances from the component's origin, shape (V,).
        radius: Growth of each piece, shape (P,).
        disc: A disc (x, y, radius) that holds each piece, in the component's frame, shape (P, 3).
        pairs: Pairs of pieces that must not touch, shape (K, 2).
    """

    parent: IntArray
    axis: IntArray
    turning: IntArray
    joint: FloatArray
    reach: FloatArray
    owner: IntArray
    first: IntArray
    vertices: FloatArray
    normals: FloatArray
    offsets: FloatArray
    radius: FloatArray
    disc: FloatArray
    pairs: IntArray


def team_arrays(tree: ComponentTree) -> TeamArrays:
    """Lay a tree out for the compiled checks."""
    joints = [component.joint for component in tree.components]
    entries = [
        (c, b, shape)
        for c, component in enumerate(tree.components)
        for b, body in enumerate(component.bodies)
        for shape in body.shapes
    ]
    rings = [shape.vertices for _, _, shape in entries]
    edges = [normals(edge_angles(ring)) if len(ring) > 1 else np.zeros((1, 2)) for ring in rings]
    members: dict[tuple[int, int], list[int]] = {}
    for number, (c, b, _) in enumerate(entries):
        members.setdefault((c, b), []).append(number)
    pairs = [(i, j) for a, b in tree.collision_pairs for i in members[a] for j in members[b]]
    reach = [
        max((float(np.hypot(*s.vertices.T).max()) + s.radius for i, _, s in entries if i == c), default=0.0)
        for c in range(len(tree.components))
    ]
    return TeamArrays(
        parent=np.array([-1 if c.parent is None else c.parent for c in tree.components]),
        axis=np.array([2 if joint is None else 3 + joint.index for joint in joints]),
        turning=np.array([0 if joint is not None and joint.kind == "prismatic" else 1 for joint in joints]),
        joint=np.array(
            [
                (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
                if joint is None
                else (joint.X_PJ.x, joint.X_PJ.y, joint.X_PJ.angle, joint.sign, *joint.axis)
                for joint in joints
            ]
        ),
        reach=np.array(reach),
        owner=np.array([c for c, _, _ in entries]),
        first=np.concatenate(([0], np.cumsum([len(ring) for ring in rings]))),
        vertices=np.concatenate(rings),
        normals=np.concatenate(edges),
        offsets=np.concatenate([(n * ring).sum(axis=1) for n, ring in zip(edges, rings, strict=True)]),
        radius=np.array([shape.radius for _, _, shape in entries]),
        disc=np.array([_disc(shape) for _, _, shape in entries]),
        pairs=np.array(pairs, dtype=np.int64).reshape(-1, 2),
    )


def _disc(shape: ConvexShape) -> tuple[float, float, float]:
    middle = 0.5 * (shape.vertices.min(axis=0) + shape.vertices.max(axis=0))
    reach = float(np.hypot(*(shape.vertices - middle).T).max()) + shape.radius
    return float(middle[0]), float(middle[1]), reach


def wall_segments(rings: list[FloatArray]) -> FloatArray:
    """Edges (x0, y0, x1, y1) of closed rings, shape (E, 4) [m]."""
    return np.concatenate([np.hstack((ring, following(ring))) for ring in rings])


@numba.njit(cache=True)
def place(team: TeamArrays, z: FloatArray) -> FloatArray:
    """Poses X_WC of all components as (x, y, cos, sin), shape (C, 4)."""
    poses = np.empty((len(team.parent), 4))
    angles = np.empty(len(team.parent))
    for c in range(len(team.parent)):
        p = team.parent[c]
        if p < 0:
            x, y, angle = z[0], z[1], z[2]
        else:
            jx, jy, ja, sign, ax, ay = team.joint[c]
            x = poses[p, 0] + poses[p, 2] * jx - poses[p, 3] * jy
            y = poses[p, 1] + poses[p, 3] * jx + poses[p, 2] * jy
            angle = angles[p] + ja
            q = z[team.axis[c]]
            if team.turning[c] == 1:
                angle += sign * q
            else:
                x += (cos(angle) * ax - sin(angle) * ay) * q
                y += (sin(angle) * ax + cos(angle) * ay) * q
        angles[c] = angle
        poses[c, 0], poses[c, 1], poses[c, 2], poses[c, 3] = x, y, cos(angle), sin(angle)
    return poses


@numba.njit(cache=True)
def _point_segment(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Squared distance of a point from a segment."""
    ux, uy = bx - ax, by - ay
    length = ux * ux + uy * uy
    t = 0.0 if length == 0.0 else min(1.0, max(0.0, ((px - ax) * ux + (py - ay) * uy) / length))
    dx, dy = px - ax - t * ux, py - ay - t * uy
    return dx * dx + dy * dy


@numba.njit(cache=True)
def _segment_meets(team: TeamArrays, piece: int, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether a segment in the component's frame meets a piece, whose grown corners are taken as mitred."""
    i, j, r = team.first[piece], team.first[piece + 1], team.radius[piece]
    if j - i == 1:
        x, y = team.vertices[i]
        near: bool = _point_segment(x, y, ax, ay, bx, by) <= r * r
        return near
    enter, leave = 0.0, 1.0
    for k in range(i, j):
        nx, ny = team.normals[k]
        room = team.offsets[k] + r - nx * ax - ny * ay
        rate = nx * (bx - ax) + ny * (by - ay)
        if rate > 0.0:
            leave = min(leave, room / rate)
        elif rate < 0.0:
            enter = max(enter, room / rate)
        elif room < 0.0:
            return False
        if enter > leave:
            return False
    return True


@numba.njit(cache=True)
def _apart(team: TeamArrays, poses: FloatArray, a: int, b: int, gap: float) -> bool:
    """Whether piece a keeps the gap from b: an edge of b, or b's rim if a is a disc, tells them apart."""
    A, B = poses[team.owner[a]], poses[team.owner[b]]
    dx, dy = A[0] - B[0], A[1] - B[1]
    ox, oy = B[2] * dx + B[3] * dy, B[2] * dy - B[3] * dx
    c, s = B[2] * A[2] + B[3] * A[3], B[2] * A[3] - B[3] * A[2]
    need = team.radius[a] + team.radius[b] + gap
    i, j = team.first[b], team.first[b + 1]
    m, n = team.first[a], team.first[a + 1]
    outside = j - i == 1
    for k in range(i, j):
        if j - i == 1:
            break
        nearest = np.inf
        for v in range(m, n):
            x, y = team.vertices[v]
            px, py = ox + c * x - s * y, oy + s * x + c * y
            nearest = min(nearest, team.normals[k, 0] * px + team.normals[k, 1] * py - team.offsets[k])
        if nearest > need:
            return True
        outside = outside or nearest > 0.0
    if n - m > 1 or not outside:
        return False
    x, y = team.vertices[m]
    px, py = ox + c * x - s * y, oy + s * x + c * y
    for k in range(i, j):
        after = k + 1 if k + 1 < j else i
        u, w = team.vertices[k], team.vertices[after]
        if _point_segment(px, py, u[0], u[1], w[0], w[1]) <= need * need:
            return False
    return True


@numba.njit(cache=True)
def _far(team: TeamArrays, poses: FloatArray, a: int, b: int, gap: float) -> bool:
    """Whether the discs about two pieces keep the gap already."""
    A, B = poses[team.owner[a]], poses[team.owner[b]]
    ax, ay, ar = team.disc[a]
    bx, by, br = team.disc[b]
    dx = A[0] + A[2] * ax - A[3] * ay - B[0] - B[2] * bx + B[3] * by
    dy = A[1] + A[3] * ax + A[2] * ay - B[1] - B[3] * bx - B[2] * by
    reach = ar + br + gap
    far: bool = dx * dx + dy * dy > reach * reach
    return far


@numba.njit(cache=True)
def is_free(team: TeamArrays, walls: FloatArray, z: FloatArray, gap: float) -> bool:
    """Whether a configuration touches no wall and no two bodies come closer than the gap.

    Args:
        team: The team.
        walls: Edges of the workspace, shape (E, 4) [m].
        z: (x, y, theta, q...), shape (3 + n,).
        gap: Distance that pairs of bodies must keep [m].
    """
    poses = place(team, z)
    x = poses[team.owner[0], 0] + poses[team.owner[0], 2] * team.vertices[0, 0]
    x -= poses[team.owner[0], 3] * team.vertices[0, 1]
    y = poses[team.owner[0], 1] + poses[team.owner[0], 3] * team.vertices[0, 0]
    y += poses[team.owner[0], 2] * team.vertices[0, 1]
    inside = False
    for e in range(len(walls)):
        x0, y0, x1, y1 = walls[e]
        if (y0 > y) != (y1 > y) and x0 + (y - y0) * (x1 - x0) / (y1 - y0) > x:
            inside = not inside
        for c in range(len(team.parent)):
            px, py, co, si = poses[c]
            reach = team.reach[c]
            if max(x0, x1) < px - reach or min(x0, x1) > px + reach:
                continue
            if max(y0, y1) < py - reach or min(y0, y1) > py + reach:
                continue
            if _point_segment(px, py, x0, y0, x1, y1) > reach * reach:
                continue
            ax, ay = co * (x0 - px) + si * (y0 - py), co * (y0 - py) - si * (x0 - px)
            bx, by = co * (x1 - px) + si * (y1 - py), co * (y1 - py) - si * (x1 - px)
            for piece in range(len(team.owner)):
                if team.owner[piece] == c and _segment_meets(team, piece, ax, ay, bx, by):
                    return False
    if not inside:
        return False
    for k in range(len(team.pairs)):
        a, b = team.pairs[k]
        if _far(team, poses, a, b, gap):
            continue
        if not _apart(team, poses, a, b, gap) and not _apart(team, poses, b, a, gap):
            return False
    return True


@numba.njit(cache=True)
def segment_is_free(
    team: TeamArrays,
    walls: FloatArray,
    first: FloatArray,
    last: FloatArray,
    gap: float,
    scale: FloatArray,
    step: float,
) -> float:
    """Share of a straight segment up to the first configuration that is not free; 1 if all are.

    Args:
        team: The team.
        walls: Edges of the workspace, shape (E, 4).
        first: Free configuration to leave from, shape (d,).
        last: Configuration to reach, shape (d,).
        gap: Distance that pairs of bodies must keep [m].
        scale: How far a unit of each axis moves the team, shape (d,).
        step: Distance between checks [m].
    """
    length = 0.0
    for k in range(len(first)):
        length = max(length, abs(last[k] - first[k]) * scale[k])
    count = max(1, int(np.ceil(length / step)))
    for i in range(1, count + 1):
        if not is_free(team, walls, first + (last - first) * (i / count), gap):
            return (i - 1) / count
    return 1.0
