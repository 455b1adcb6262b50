"""Margins and distances of every accepted step, compiled; few calls, for passing arrays takes most time."""

from __future__ import annotations

from math import inf

import numpy as np

from coop_drake.geometry.boundary import signed_distance
from coop_drake.jit import compiled
from coop_drake.simulation.convex_distance import nearest_pair, nearest_to_walls
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays, moved, place


@compiled
def team_distances(team: TeamArrays, walls: FloatArray, z: FloatArray) -> tuple[float, int, float, int]:
    """Return the smallest distance to the walls and its piece, then that between bodies and its pair.

    Args:
        team: The team.
        walls: Edges (x0, y0, x1, y1) of the floor's rings, shape (E, 4) [m].
        z: (x, y, theta, q...), shape (3 + n,) [m, rad].
    """
    vertices, discs = np.empty(team.vertices.shape), np.empty(team.discs.shape)
    place_pieces(team, z, vertices, discs)
    wall, piece = nearest_to_walls(team, vertices, discs, walls)
    between, pair = nearest_pair(team, vertices, discs)
    return wall, piece, between, pair


@compiled
def place_pieces(team: TeamArrays, z: FloatArray, vertices: FloatArray, discs: FloatArray) -> None:
    """Write where vertices and discs of all pieces are in W, as ``nearest_to_walls`` takes them."""
    poses = place(team, z)
    for i in range(len(team.pieces)):
        c = team.pieces[i, 0]
        x, y, cosine, sine = poses[c, 0], poses[c, 1], poses[c, 2], poses[c, 3]
        discs[i, 0], discs[i, 1] = moved(x, y, cosine, sine, team.discs[i, 0], team.discs[i, 1])
        discs[i, 2] = team.discs[i, 2]
        for k in range(team.pieces[i, 1], team.pieces[i, 2]):
            u, v = team.vertices[k, 0], team.vertices[k, 1]
            vertices[k, 0], vertices[k, 1] = moved(x, y, cosine, sine, u, v)


@compiled(borrows=True)
def margins(
    team: TeamArrays, walls: FloatArray,
    z: FloatArray, cell: FloatArray, lower: FloatArray, upper: FloatArray,
    funnel_lower: FloatArray, funnel_upper: FloatArray, commanded: FloatArray, measured: FloatArray,
) -> tuple[float, int, float, int, float, float, int, float, int, float]:  # fmt: skip
    """Return what ``team_distances`` returns, then the margins of cell, funnels, slice and wrenches.

    Args:
        team: With the next two as in ``team_distances``.
        walls: Of the floor.
        z: The configuration.
        cell: Edges of the cell's governed set, shape (edges, 4) [m].
        lower: Of the cell's slice, shape (1 + n,) [rad or m].
        upper: Of the cell's slice, shape (1 + n,) [rad or m].
        funnel_lower: Lower funnel bounds, shape (1 + n,) [rad or m].
        funnel_upper: Upper funnel bounds, shape (1 + n,) [rad or m].
        commanded: Commanded wrenches of the end effectors, shape (N, 3) [N, N m].
        measured: Wrenches that the grasps transmit, shape (N, 3) [N, N m].

    Returns:
        Distances; signed distance of the object to its cell's boundary [m]; smallest margin to a funnel and
        the axis; smallest margin to the slice and the axis; largest difference of wrenches.
    """
    wall, piece, between, pair = team_distances(team, walls, z)
    in_cell = signed_distance(cell, z[0], z[1])
    funnel, funnel_axis = _narrowest(z, funnel_lower, funnel_upper)
    margin, slice_axis = _narrowest(z, lower, upper)
    error = largest_difference(measured, commanded)
    return wall, piece, between, pair, in_cell, funnel, funnel_axis, margin, slice_axis, error


@compiled
def row_figures(
    governors: FloatArray, accelerations: FloatArray, realised: FloatArray, energy_margins: FloatArray,
    grasp_errors: FloatArray, clock_lags: FloatArray, causes: FloatArray,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Return figures of one step for the log; one that rests on NaN is NaN.

    Args:
        governors: p_G as every robot keeps it, shape (N, 2) [m].
        accelerations: Commanded accelerations of the object, shape (N, 3) [m/s^2, rad/s^2].
        realised: Accelerations of z in the plant, shape (3 + n,).
        energy_margins: Delta E of every robot, shape (N,) [m^2/s^2].
        grasp_errors: Shape (N,) [m].
        clock_lags: Lag of the funnels' clock [s], shape (1,), or (0,) where there is none.
        causes: Why the team is held, see ``HoldSupervisor``; of shape (0,) where it never is.

    Returns:
        Largest differences of copies of p_G, and of commanded to realised acceleration; smallest Delta E;
        largest error of a grasp; lag of the clock; 1 where the team is held, else 0.
    """
    spread = largest_difference(governors, governors[:1])
    difference = largest_difference(accelerations, realised[:3].copy().reshape((1, 3)))
    lag = clock_lags[0] if clock_lags.size else 0.0
    return spread, difference, energy_margins.min(), grasp_errors.max(), lag, 1.0 * causes.any()


@compiled(borrows=True)
def largest_difference(rows: FloatArray, others: FloatArray) -> float:
    """Return the largest magnitude of a component of a difference, NaN if a component is NaN.

    Args:
        rows: Shape (N, k).
        others: Rows to compare with, shape (N, k), or (1, k) to compare all with the same row.
    """
    largest = 0.0
    for i in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            difference = abs(rows[i, k] - others[i % others.shape[0], k])
            if np.isnan(difference):
                return np.nan
            largest = max(largest, difference)
    return largest


@compiled(borrows=True)
def _narrowest(z: FloatArray, lower: FloatArray, upper: FloatArray) -> tuple[float, int]:
    """Return the smallest distance of an axis to its interval's ends, and the axis; NaN if one is NaN."""
    least, axis = inf, 0
    for i in range(lower.size):
        margin = min(z[2 + i] - lower[i], upper[i] - z[2 + i])
        if np.isnan(z[2 + i] - lower[i]) or np.isnan(upper[i] - z[2 + i]):
            return np.nan, i
        if margin < least:
            least, axis = margin, i
    return least, axis
