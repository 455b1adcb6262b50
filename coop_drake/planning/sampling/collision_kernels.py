"""Compiled exact checks of single configurations: they steer the sampler and prove nothing."""

from __future__ import annotations

from math import cos, hypot, sin, sqrt

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.planning.sampling.obstacle_grid import Walls, crosses, point_segment
from coop_drake.planning.sampling.team_arrays import TeamArrays
from coop_drake.tree.pose import FloatArray


@compiled
def place(team: TeamArrays, z: FloatArray) -> FloatArray:
    """Poses X_WC of all components as (x, y, cos, sin), shape (C, 4)."""
    poses = np.empty((len(team.parent), 4))
    angles = np.empty(len(team.parent))
    for c in range(len(team.parent)):
        p = team.parent[c]
        if p < 0:
            x, y, angle = z[0], z[1], z[2]
        else:
            jx, jy = team.joint[c, 0], team.joint[c, 1]
            x = poses[p, 0] + poses[p, 2] * jx - poses[p, 3] * jy
            y = poses[p, 1] + poses[p, 3] * jx + poses[p, 2] * jy
            angle = angles[p] + team.joint[c, 2]
            q = z[team.axis[c]]
            if team.turning[c] == 1:
                angle += team.joint[c, 3] * q
            else:
                ax, ay = team.joint[c, 4], team.joint[c, 5]
                x += (cos(angle) * ax - sin(angle) * ay) * q
                y += (sin(angle) * ax + cos(angle) * ay) * q
        angles[c] = angle
        poses[c, 0], poses[c, 1], poses[c, 2], poses[c, 3] = x, y, cos(angle), sin(angle)
    return poses


@compiled
def _segment_gap(team: TeamArrays, piece: int, ax: float, ay: float, bx: float, by: float) -> float:
    """Distance of a segment in the component's frame from a piece that it does not meet, 0 if it does."""
    i, j = team.first[piece], team.first[piece + 1]
    best = np.inf
    for k in range(i, j):
        after = k + 1 if k + 1 < j else i
        ux, uy, wx, wy = (
            team.vertices[k, 0],
            team.vertices[k, 1],
            team.vertices[after, 0],
            team.vertices[after, 1],
        )
        best = min(best, point_segment(ux, uy, ax, ay, bx, by))
        best = min(best, point_segment(ax, ay, ux, uy, wx, wy))
        best = min(best, point_segment(bx, by, ux, uy, wx, wy))
        if j - i == 2 and crosses(ax, ay, bx, by, ux, uy, wx, wy):
            return 0.0
    gap: float = max(sqrt(best) - team.radius[piece], 0.0)
    return gap


@compiled
def _segment_meets(team: TeamArrays, piece: int, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether a segment in the component's frame meets a piece."""
    i, j, r = team.first[piece], team.first[piece + 1], team.radius[piece]
    enter, leave = 0.0, 1.0
    deep_enter, deep_leave = 0.0, 1.0
    if j - i > 1:
        for k in range(i, j):
            nx, ny = team.normals[k, 0], team.normals[k, 1]
            room = team.offsets[k] + r - nx * ax - ny * ay
            rate = nx * (bx - ax) + ny * (by - ay)
            if rate > 0.0:
                leave = min(leave, room / rate)
                deep_leave = min(deep_leave, (room - r) / rate)
            elif rate < 0.0:
                enter = max(enter, room / rate)
                deep_enter = max(deep_enter, (room - r) / rate)
            elif room < 0.0:
                return False
            elif room < r:
                deep_leave = -1.0
            if enter > leave:
                return False
        if r == 0.0 or (j - i > 2 and deep_enter <= deep_leave):
            return True
    meets: bool = _segment_gap(team, piece, ax, ay, bx, by) <= 0.0
    return meets


@compiled
def _piece_clearance(team: TeamArrays, walls: Walls, poses: FloatArray, piece: int, most: float) -> float:
    """Distance of a piece from the walls, at most ``most``; -1 where a wall is met or it is outside."""
    c = team.owner[piece]
    px, py, co, si = poses[c, 0], poses[c, 1], poses[c, 2], poses[c, 3]
    x = px + co * team.disc[piece, 0] - si * team.disc[piece, 1]
    y = py + si * team.disc[piece, 0] + co * team.disc[piece, 1]
    radius = team.disc[piece, 2]
    column, row = np.floor((x - walls.corner[0]) / walls.side), np.floor((y - walls.corner[1]) / walls.side)
    if column < 0 or row < 0 or column >= walls.columns or row >= walls.rows:
        return -1.0
    square = int(column) * walls.rows + int(row)
    mx = walls.corner[0] + (column + 0.5) * walls.side
    my = walls.corner[1] + (row + 0.5) * walls.side
    off = hypot(x - mx, y - my)
    inside = walls.inside[square] == 1
    best = min(most, walls.reach - radius)
    for k in range(walls.first[square], walls.first[square + 1]):
        if walls.away[k] > off + radius + best:
            break
        e = walls.listed[k]
        x0, y0, x1, y1 = walls.edges[e, 0], walls.edges[e, 1], walls.edges[e, 2], walls.edges[e, 3]
        if walls.away[k] <= off and crosses(mx, my, x, y, x0, y0, x1, y1):
            inside = not inside
        if point_segment(x, y, x0, y0, x1, y1) > (radius + best) ** 2:
            continue
        ax, ay = co * (x0 - px) + si * (y0 - py), co * (y0 - py) - si * (x0 - px)
        bx, by = co * (x1 - px) + si * (y1 - py), co * (y1 - py) - si * (x1 - px)
        if _segment_meets(team, piece, ax, ay, bx, by):
            return -1.0
        if best > 0.0:
            best = min(best, _segment_gap(team, piece, ax, ay, bx, by))
    return best if inside else -1.0


@compiled
def _apart(team: TeamArrays, poses: FloatArray, a: int, b: int, gap: float) -> bool:
    """Whether piece a keeps the gap from b: an edge of b, or b's rim if a is a disc, tells them apart."""
    A, B = team.owner[a], team.owner[b]
    bc, bs = poses[B, 2], poses[B, 3]
    dx, dy = poses[A, 0] - poses[B, 0], poses[A, 1] - poses[B, 1]
    ox, oy = bc * dx + bs * dy, bc * dy - bs * dx
    c, s = bc * poses[A, 2] + bs * poses[A, 3], bc * poses[A, 3] - bs * poses[A, 2]
    need = team.radius[a] + team.radius[b] + gap
    i, j = team.first[b], team.first[b + 1]
    m, n = team.first[a], team.first[a + 1]
    outside = j - i == 1
    for k in range(i, j if j - i > 1 else i):
        nx, ny = team.normals[k, 0], team.normals[k, 1]
        ux, uy = c * nx + s * ny, c * ny - s * nx
        nearest = np.inf
        for v in range(m, n):
            nearest = min(nearest, ux * team.vertices[v, 0] + uy * team.vertices[v, 1])
        nearest += nx * ox + ny * oy - team.offsets[k]
        if nearest > need:
            return True
        outside = outside or nearest > 0.0
    if n - m > 1 or not outside:
        return False
    x, y = team.vertices[m, 0], team.vertices[m, 1]
    px, py = ox + c * x - s * y, oy + s * x + c * y
    for k in range(i, j):
        w = k + 1 if k + 1 < j else i
        ux, uy, wx, wy = team.vertices[k, 0], team.vertices[k, 1], team.vertices[w, 0], team.vertices[w, 1]
        if point_segment(px, py, ux, uy, wx, wy) <= need * need:
            return False
    return True


@compiled
def _far(team: TeamArrays, poses: FloatArray, a: int, b: int, gap: float) -> bool:
    """Whether the discs about two pieces keep the gap already."""
    A, B = team.owner[a], team.owner[b]
    ax, ay, bx, by = team.disc[a, 0], team.disc[a, 1], team.disc[b, 0], team.disc[b, 1]
    dx = poses[A, 0] + poses[A, 2] * ax - poses[A, 3] * ay - poses[B, 0] - poses[B, 2] * bx + poses[B, 3] * by
    dy = poses[A, 1] + poses[A, 3] * ax + poses[A, 2] * ay - poses[B, 1] - poses[B, 3] * bx - poses[B, 2] * by
    reach = team.disc[a, 2] + team.disc[b, 2] + gap
    far: bool = dx * dx + dy * dy > reach * reach
    return far


@compiled
def bodies_apart(team: TeamArrays, poses: FloatArray, gap: float) -> bool:
    """Whether no two bodies come closer than the gap."""
    for k in range(len(team.pairs)):
        a, b = team.pairs[k, 0], team.pairs[k, 1]
        if _far(team, poses, a, b, gap):
            continue
        if not _apart(team, poses, a, b, gap) and not _apart(team, poses, b, a, gap):
            return False
    return True


@compiled
def wall_clearance(team: TeamArrays, walls: Walls, poses: FloatArray, most: float) -> float:
    """Distance of the team from the walls, at most ``most``; -1 where a wall is met or a piece is outside.

    Args:
        team: The team.
        walls: The floor, whose reach is that of the widest piece and ``most`` more.
        poses: Poses of all components, shape (C, 4).
        most: Distances above this one do not matter [m].
    """
    best = most
    for piece in range(len(team.owner) - 1, -1, -1):
        best = _piece_clearance(team, walls, poses, piece, best)
        if best < 0.0:
            return -1.0
    return best


@compiled
def is_free(team: TeamArrays, walls: Walls, z: FloatArray, gap: float) -> bool:
    """Whether a configuration touches no wall and no two bodies come closer than the gap.

    Args:
        team: The team.
        walls: The floor.
        z: (x, y, theta, q...), shape (3 + n,).
        gap: Distance that pairs of bodies must keep [m].
    """
    poses = place(team, z)
    free: bool = wall_clearance(team, walls, poses, 0.0) >= 0.0 and bodies_apart(team, poses, gap)
    return free


@compiled
def segment_is_free(
    team: TeamArrays,
    walls: Walls,
    first: FloatArray,
    last: FloatArray,
    gap: float,
    scale: FloatArray,
    step: float,
) -> float:
    """Share of a straight segment up to the first configuration that is not free; 1 if all are.

    Args:
        team: The team.
        walls: The floor.
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
