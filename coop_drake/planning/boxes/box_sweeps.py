"""Compiled over-sweeps of a whole team through a box, and whether its bodies touch anywhere in it."""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.body_pairs import TOUCH
from coop_drake.geometry.distances import separated
from coop_drake.geometry.piece_sweeps import joint_width, over_joint, rounded_sweep
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.tree.team_arrays import TeamArrays


class BoxArrays(NamedTuple):
    """The team and the joint limits as arrays, used to test whether a box is free.

    Attributes:
        team: The team.
        pair_sweeps: The sweeps that collision pairs need, each once: a piece and its number of stages, in the
            order in which a box sweeps them: the last piece first, fewer stages first, shape (S, 2).
        pairs: Pairs of rows of ``pair_sweeps`` that must not touch, shape (K, 2).
        lower: Lower limits of (theta, q...), minus infinity for theta, shape (1 + n,).
        upper: Upper limits, shape (1 + n,).
    """

    team: TeamArrays
    pair_sweeps: IntArray
    pairs: IntArray
    lower: FloatArray
    upper: FloatArray


@compiled
def enclosing_disc(ring: FloatArray, disc: FloatArray) -> None:
    """Write a disc (x, y, radius) that holds a ring, shape (n, 2) [m], into ``disc``, shape (3,) [m]."""
    disc[0], disc[1], disc[2] = 0.0, 0.0, 0.0
    for i in range(len(ring)):
        disc[0] += ring[i, 0] / len(ring)
        disc[1] += ring[i, 1] / len(ring)
    for i in range(len(ring)):
        disc[2] = max(disc[2], hypot(ring[i, 0] - disc[0], ring[i, 1] - disc[1]))


@compiled
def with_ring(vertices: FloatArray, size: int, ring: FloatArray) -> FloatArray:
    """Write a ring into the rows from ``size`` on; returns a longer copy where there are too few, (V, 2)."""
    if size + len(ring) > len(vertices):
        longer = np.empty((2 * (size + len(ring)), 2))
        for k in range(size):
            longer[k, 0], longer[k, 1] = vertices[k, 0], vertices[k, 1]
        vertices = longer
    for k in range(len(ring)):
        vertices[size + k, 0], vertices[size + k, 1] = ring[k, 0], ring[k, 1]
    return vertices


class PairSweeps(NamedTuple):
    """Memory for the sweeps that collision pairs need, those of ``BoxArrays.pair_sweeps``.

    Attributes:
        first: First vertex of each and the vertex after the last one, shape (S + 1,).
        widths: Width of the widest interval that each was swept through, shape (S,) [rad or m].
    """

    first: IntArray
    widths: FloatArray


@compiled
def room_for_sweeps(count: int) -> PairSweeps:
    """Memory for some sweeps."""
    return PairSweeps(np.zeros(count + 1, np.int64), np.zeros(count))


@compiled
def swept_piece(
    boxes: BoxArrays,
    piece: int,
    lower: FloatArray,
    upper: FloatArray,
    sweeps: PairSweeps,
    vertices: FloatArray,
    row: int,
) -> tuple[FloatArray, FloatArray, int]:
    """Sweep a piece through a box, eq. (6), and keep what collision pairs need of it on the way.

    The sweep over a piece's first joints is an intermediate result of the sweep over all of them.

    Args:
        boxes: The team.
        piece: Index of the piece.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        sweeps: Memory; its entries for the piece are written.
        vertices: Sweeps of the rows before, not grown by radii, shape (V, 2) [m].
        row: First row of ``pair_sweeps`` that is of this piece or of one that follows.

    Returns:
        The sweep over all joints with the piece's radius, shape (n, 2) [m]; ``vertices`` with the piece's
        sweeps, a longer copy where there were too few rows; the first row of a following piece.
    """
    team = boxes.team
    ring = team.vertices[team.pieces[piece, 1] : team.pieces[piece, 2]].copy()
    link, stages, widest = team.pieces[piece, 0], 0, 0.0
    while True:
        needed = row < len(boxes.pair_sweeps) and boxes.pair_sweeps[row, 0] == piece
        if needed and boxes.pair_sweeps[row, 1] == stages:
            vertices = with_ring(vertices, sweeps.first[row], ring)
            sweeps.first[row + 1] = sweeps.first[row] + len(ring)
            sweeps.widths[row] = widest
            row += 1
        if link < 0:
            return rounded_sweep(team, piece, ring, widest), vertices, row
        widest = max(widest, joint_width(team, link, lower, upper))
        ring = over_joint(team, link, ring, lower, upper)
        link, stages = team.links[link, 0], stages + 1


@compiled
def bodies_apart(boxes: BoxArrays, sweeps: PairSweeps, swept: FloatArray) -> bool:
    """Whether no two bodies touch anywhere in a box: their over-sweeps are separated.

    Args:
        boxes: The team.
        sweeps: Where the sweeps are.
        swept: The sweeps, see ``swept_piece``, shape (V, 2) [m].
    """
    count = len(boxes.pair_sweeps)
    vertices, first = np.empty((32 * count, 2)), np.zeros(count + 1, np.int64)
    discs = np.empty((count, 3))
    for k in range(count):
        ring = swept[sweeps.first[k] : sweeps.first[k + 1]]
        ring = rounded_sweep(boxes.team, boxes.pair_sweeps[k, 0], ring, sweeps.widths[k])
        enclosing_disc(ring, discs[k])
        vertices = with_ring(vertices, first[k], ring)
        first[k + 1] = first[k] + len(ring)
    for k in range(len(boxes.pairs)):
        i, j = boxes.pairs[k, 0], boxes.pairs[k, 1]
        far = hypot(discs[i, 0] - discs[j, 0], discs[i, 1] - discs[j, 1])
        if far <= discs[i, 2] + discs[j, 2] + 2.0 * TOUCH and not separated(
            vertices[first[i] : first[i + 1]], vertices[first[j] : first[j + 1]], TOUCH
        ):
            return False
    return True
