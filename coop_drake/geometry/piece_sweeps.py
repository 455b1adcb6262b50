"""Compiled over-sweeps of a team's pieces, eq. (6): through one joint after the other, up to the object."""

from __future__ import annotations

from math import cos, sin

from coop_drake.geometry.sweeps import disc_turn, grown, over_prismatic, over_revolute
from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays, moved


@compiled
def over_joint(
    team: TeamArrays, link: int, vertices: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Enclose a convex set that one joint moves through its interval, eq. (6).

    Args:
        team: The team.
        link: Index of the component that the joint moves; the object's is turned by theta.
        vertices: The set in that component's frame, see ``over_revolute``, shape (n, 2) [m].
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).

    Returns:
        Vertices in the parent's frame, in W for the object's component, shape (m, 2) [m].
    """
    axis = team.links[link, 1] - 2
    low, high = lower[axis], upper[axis]
    if team.links[link, 2] == 1:
        ring = over_revolute(vertices, team.joints[link, 3] * 0.5 * (low + high), 0.5 * (high - low))
    else:
        ax, ay = team.joints[link, 4], team.joints[link, 5]
        ring = over_prismatic(vertices, ax * low, ay * low, ax * high, ay * high)
    x, y, angle = team.joints[link, 0], team.joints[link, 1], team.joints[link, 2]
    c, s = cos(angle), sin(angle)
    for i in range(len(ring)):
        ring[i, 0], ring[i, 1] = moved(x, y, c, s, ring[i, 0], ring[i, 1])
    return ring


@compiled(borrows=True)
def joint_width(team: TeamArrays, link: int, lower: FloatArray, upper: FloatArray) -> float:
    """Width of the interval of the joint that moves a component [rad or m]; others as in ``over_joint``."""
    axis = team.links[link, 1] - 2
    width: float = upper[axis] - lower[axis]
    return width


@compiled
def over_piece(
    team: TeamArrays, piece: int, lower: FloatArray, upper: FloatArray, stages: int, rounded: bool
) -> FloatArray:
    """Compute a polygon that encloses a piece at every configuration of a slice, eq. (6).

    Args:
        team: The team.
        piece: Index of the piece.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        stages: Number of joints to sweep, from the piece's own; theta is the last one, and any larger number
            means all.
        rounded: Whether to grow the sweep by the piece's radius.

    Returns:
        Vertices, counter-clockwise, shape (n, 2) [m].
    """
    ring = team.vertices[team.pieces[piece, 1] : team.pieces[piece, 2]].copy()
    widest = 0.0
    link = team.pieces[piece, 0]
    while link >= 0 and stages > 0:
        widest = max(widest, joint_width(team, link, lower, upper))
        ring = over_joint(team, link, ring, lower, upper)
        link, stages = team.links[link, 0], stages - 1
    return rounded_sweep(team, piece, ring, widest) if rounded else ring


@compiled
def rounded_sweep(team: TeamArrays, piece: int, ring: FloatArray, widest: float) -> FloatArray:
    """Grow the sweep of a piece's vertices by its radius.

    Args:
        team: The team.
        piece: Index of the piece.
        ring: The sweep, shape (n, 2) [m].
        widest: Width of the widest interval that it was swept through [rad or m].

    Returns:
        Vertices, shape (m, 2) [m].
    """
    radius = team.radii[piece]
    return grown(ring, radius, disc_turn(0.5 * widest)) if radius > 0.0 else ring
