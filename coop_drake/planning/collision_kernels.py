"""Compiled exact checks of single configurations: they steer the sampler and prove nothing."""

from __future__ import annotations

from math import cos, sin

import numba
import numpy as np

from coop_drake.geometry.pose import FloatArray
from coop_drake.planning.team_arrays import TeamArrays


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
def point_segment(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Squared distance of a point from a segment."""
    ux, uy = bx - ax, by - ay
    length = ux * ux + uy * uy
    t = 0.0 if length == 0.0 else min(1.0, max(0.0, ((px - ax) * ux + (py - ay) * uy) / length))
    dx, dy = px - ax - t * ux, py - ay - t * uy
    return dx * dx + dy * dy


@numba.njit(cache=True)
def _cross(u: FloatArray, w: FloatArray, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether two segments cross."""
    dx, dy = bx - ax, by - ay
    first, last = dx * (u[1] - ay) - dy * (u[0] - ax), dx * (w[1] - ay) - dy * (w[0] - ax)
    ex, ey = w[0] - u[0], w[1] - u[1]
    start, end = ex * (ay - u[1]) - ey * (ax - u[0]), ex * (by - u[1]) - ey * (bx - u[0])
    crossing: bool = first * last <= 0.0 and start * end <= 0.0 and first != last
    return crossing


@numba.njit(cache=True)
def _segment_gap(team: TeamArrays, piece: int, ax: float, ay: float, bx: float, by: float) -> float:
    """Distance of a segment in the component's frame from a piece, 0 if they meet."""
    i, j = team.first[piece], team.first[piece + 1]
    best, enter, leave = np.inf, 0.0, 1.0 if j - i > 2 else -1.0
    for k in range(i, j):
        u, w = team.vertices[k], team.vertices[k + 1 if k + 1 < j else i]
        nx, ny = team.normals[k]
        room = team.offsets[k] - nx * ax - ny * ay
        rate = nx * (bx - ax) + ny * (by - ay)
        if rate > 0.0:
            leave = min(leave, room / rate)
        elif rate < 0.0:
            enter = max(enter, room / rate)
        elif room < 0.0:
            leave = -1.0
        best = min(best, point_segment(u[0], u[1], ax, ay, bx, by))
        best = min(best, point_segment(ax, ay, u[0], u[1], w[0], w[1]))
        best = min(best, point_segment(bx, by, u[0], u[1], w[0], w[1]))
    if enter <= leave or (j - i == 2 and _cross(team.vertices[i], team.vertices[i + 1], ax, ay, bx, by)):
        return 0.0
    gap: float = max(np.sqrt(best) - team.radius[piece], 0.0)
    return gap


@numba.njit(cache=True)
def _segment_meets(team: TeamArrays, piece: int, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether a segment in the component's frame meets a piece."""
    i, j, r = team.first[piece], team.first[piece + 1], team.radius[piece]
    enter, leave = 0.0, 1.0
    for k in range(i, j):
        if j - i == 1:
            break
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
    meets: bool = r == 0.0 or _segment_gap(team, piece, ax, ay, bx, by) <= 0.0
    return meets


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
        if point_segment(px, py, u[0], u[1], w[0], w[1]) <= need * need:
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
def bodies_apart(team: TeamArrays, poses: FloatArray, gap: float) -> bool:
    """Whether no two bodies come closer than the gap."""
    for k in range(len(team.pairs)):
        a, b = team.pairs[k]
        if _far(team, poses, a, b, gap):
            continue
        if not _apart(team, poses, a, b, gap) and not _apart(team, poses, b, a, gap):
            return False
    return True


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
    free: bool = wall_clearance(team, walls, poses, 0.0) >= 0.0 and bodies_apart(team, poses, gap)
    return free


@numba.njit(cache=True)
def wall_clearance(team: TeamArrays, walls: FloatArray, poses: FloatArray, most: float) -> float:
    """Distance of the team from the walls, at most ``most``; -1 where a wall is met or the team is outside.

    Args:
        team: The team.
        walls: Edges of the workspace, shape (E, 4) [m].
        poses: Poses of all components, shape (C, 4).
        most: Distances above this one do not matter [m].
    """
    px, py, co, si = poses[team.owner[0]]
    u, v = team.vertices[0]
    x, y = px + co * u - si * v, py + si * u + co * v
    inside = False
    best = most
    for e in range(len(walls)):
        x0, y0, x1, y1 = walls[e]
        if (y0 > y) != (y1 > y) and x0 + (y - y0) * (x1 - x0) / (y1 - y0) > x:
            inside = not inside
        for c in range(len(team.parent)):
            px, py, co, si = poses[c]
            reach = team.reach[c] + best
            if max(x0, x1) < px - reach or min(x0, x1) > px + reach:
                continue
            if max(y0, y1) < py - reach or min(y0, y1) > py + reach:
                continue
            if point_segment(px, py, x0, y0, x1, y1) > reach * reach:
                continue
            ax, ay = co * (x0 - px) + si * (y0 - py), co * (y0 - py) - si * (x0 - px)
            bx, by = co * (x1 - px) + si * (y1 - py), co * (y1 - py) - si * (x1 - px)
            for piece in range(len(team.owner)):
                if team.owner[piece] != c:
                    continue
                if _segment_meets(team, piece, ax, ay, bx, by):
                    return -1.0
                if best > 0.0:
                    best = min(best, _segment_gap(team, piece, ax, ay, bx, by))
    return best if inside else -1.0


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
