"""Boxes of configurations that are proved free by over-sweeps, laid along a candidate path."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import NamedTuple

import numpy as np
from shapely import MultiPolygon, Polygon

from coop_drake.geometry.polygons import separated
from coop_drake.geometry.sweeps import TOUCH, disc_turn, grown, over_joint
from coop_drake.jit import compiled
from coop_drake.planning.cells.cells import FreeBox
from coop_drake.planning.sampling.collision import ObstacleGrid, densified, grid_inside, ring_clearance
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import ComponentTree, TeamArrays

# Compiled over-sweeps of a whole team through a box, and whether its bodies touch anywhere in it.


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


@compiled(borrows=True)
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
def sweeps_memory(boxes: BoxArrays) -> tuple[PairSweeps, FloatArray]:
    """Memory for the sweeps of a team's collision pairs, and for their vertices, shape (V, 2)."""
    count = len(boxes.pair_sweeps)
    return PairSweeps(np.zeros(count + 1, np.int64), np.zeros(count)), np.empty((16 * count, 2))


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
            return grown(ring, team.radii[piece], disc_turn(0.5 * widest)), vertices, row
        axis = team.links[link, 1] - 2
        widest = max(widest, upper[axis] - lower[axis])
        ring = over_joint(team, link, ring, lower, upper)
        link, stages = team.links[link, 0], stages + 1


@compiled
def sweeps_apart(boxes: BoxArrays, sweeps: PairSweeps, swept: FloatArray) -> bool:
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
        radius = boxes.team.radii[boxes.pair_sweeps[k, 0]]
        ring = grown(ring, radius, disc_turn(0.5 * sweeps.widths[k]))
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


# Compiled boxes along a path: the longest whose swept footprint stays clear of obstacles and of itself.
#
# What these kernels call free is proved: they use the over-sweeps of eq. (6), a floor shrunk by more than
# rounding errors, and the fact that a footprint at a distance c from all obstacles may move by less than c
# in any direction.

COARSENESS = 0.2
"""A box may fall short of the longest one by this fraction of its samples [-]: fewer boxes are tried."""

_GROWTH = 0.5
"""Samples by which a free box is made longer, over those that it holds [-]."""

_STEP_FRACTION = 0.5
"""Step along a path over the clearance there [-]: below 1, so that every place lies in a free disc."""


@compiled
def box_is_free(
    boxes: BoxArrays,
    grid: ObstacleGrid,
    lower: FloatArray,
    upper: FloatArray,
    path: FloatArray,
    start: int,
    end: int,
    enough: float,
) -> bool:
    """Whether a box is free while the position follows a part of a path: no wall is met, no bodies touch.

    The path is walked in steps shorter than the distance from the walls at each place, so that everything
    within half of that distance is proved free, too.

    Args:
        boxes: The team.
        grid: The floor, which holds the team at the first position for some angles of the box.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        path: Configurations or positions p_WL, joined by straight lines, shape (m, 2 or more) [m].
        start: First row of the part.
        end: Its last row.
        enough: Distance from the walls that is needed at the first and at the last position; half of it in
            between [m].
    """
    count = len(boxes.team.radii)
    vertices, first = np.empty((32 * count, 2)), np.zeros(count + 1, np.int64)
    discs = np.empty((count, 3))
    (sweeps, swept), row = sweeps_memory(boxes), 0
    for k in range(count):
        ring, swept, row = swept_piece(boxes, count - 1 - k, lower, upper, sweeps, swept, row)
        enclosing_disc(ring, discs[k])
        vertices = with_ring(vertices, first[k], ring)
        first[k + 1] = first[k] + len(ring)
        for at in (start, end):
            x, y = path[at, 0], path[at, 1]
            if (
                ring_clearance(
                    grid, vertices, first[k], first[k + 1], 0.0, discs[k], x, y, 1.0, 0.0, 2.0 * enough
                )
                <= enough
            ):
                return False
    if not sweeps_apart(boxes, sweeps, swept):
        return False
    passed = 0.0
    for at in range(start, end + 1):
        dx, dy, length = 0.0, 0.0, 0.0
        if at < end:
            dx, dy = path[at + 1, 0] - path[at, 0], path[at + 1, 1] - path[at, 1]
            length = hypot(dx, dy)
        while passed <= length:
            x, y = path[at, 0], path[at, 1]
            if length > 0.0:
                x += passed / length * dx
                y += passed / length * dy
            here = np.inf
            for k in range(count):
                here = ring_clearance(
                    grid, vertices, first[k], first[k + 1], 0.0, discs[k], x, y, 1.0, 0.0, here
                )
                if here <= 0.5 * enough:
                    return False
            passed += _STEP_FRACTION * here
        passed -= length
    return True


@compiled
def clearances_in_box(
    boxes: BoxArrays,
    grid: ObstacleGrid,
    lower: FloatArray,
    upper: FloatArray,
    path: FloatArray,
    start: int,
    end: int,
    most: float,
) -> FloatArray:
    """Distance of the swept team from the obstacles at some rows of a path.

    Args:
        boxes: With the next six as in ``box_is_free``.
        grid: The floor.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        path: Configurations, shape (m, 3 + n) [m, rad].
        start: First row.
        end: Last row.
        most: Distances above this one do not matter [m].

    Returns:
        Distances, shape (end - start + 1,) [m]; of shape (0,) if one row is not free or bodies may touch.
    """
    result = np.empty(end + 1 - start)
    for k in range(len(result)):
        result[k] = most
    disc = np.empty(3)
    (sweeps, swept), row = sweeps_memory(boxes), 0
    for piece in range(len(boxes.team.radii) - 1, -1, -1):
        ring, swept, row = swept_piece(boxes, piece, lower, upper, sweeps, swept, row)
        enclosing_disc(ring, disc)
        for k in range(len(result)):
            x, y = path[start + k, 0], path[start + k, 1]
            result[k] = ring_clearance(grid, ring, 0, len(ring), 0.0, disc, x, y, 1.0, 0.0, result[k])
            if result[k] < 0.0:
                return result[:0]
    return result if sweeps_apart(boxes, sweeps, swept) else result[:0]


@compiled
def padded(
    boxes: BoxArrays, path: FloatArray, start: int, end: int, pad: float
) -> tuple[FloatArray, FloatArray]:
    """Compute intervals of (theta, q...) that hold some rows of a path, padded and clipped at joint limits.

    Args:
        boxes: The team.
        path: Configurations, shape (m, 3 + n) [m, rad].
        start: First row.
        end: Last row.
        pad: Padding: at least this [rad, m], and at least this fraction of the interval [-].

    Returns:
        Lower and upper ends, shape (1 + n,) each.
    """
    lower, upper = np.empty(path.shape[1] - 2), np.empty(path.shape[1] - 2)
    for axis in range(len(lower)):
        low, high = path[start, 2 + axis], path[start, 2 + axis]
        for k in range(start + 1, end + 1):
            low, high = min(low, path[k, 2 + axis]), max(high, path[k, 2 + axis])
        grow = max(pad, pad * (high - low))
        lower[axis] = max(boxes.lower[axis], low - grow)
        upper[axis] = min(boxes.upper[axis], high + grow)
    return lower, upper


@compiled
def longest_box(
    boxes: BoxArrays,
    grid: ObstacleGrid,
    samples: FloatArray,
    first: int,
    guess: int,
    pad: float,
    clearance: float,
) -> tuple[int, int]:
    """Find about how far along a path one free box reaches: longer ones by half, then bisection.

    Args:
        boxes: The team.
        grid: The floor.
        samples: The path, shape (m, 3 + n).
        first: Sample that the box begins with.
        guess: Sample after the first one at which the first box that is tried ends; about where it ends.
        pad: Padding of the intervals, see ``padded``.
        clearance: Distance from the obstacles that is needed at both ends [m].

    Returns:
        The last sample of the longest box, ``first`` if there is none, and the number of boxes tried.
    """
    last = len(samples) - 1
    best, failed, reach, trials = first, last + 1, guess, 0
    while failed - best > max(1, int(COARSENESS * (best - first))):
        j = min(best + reach, last) if failed > last else (best + failed) // 2
        lower, upper = padded(boxes, samples, first, j, pad)
        trials += 1
        if box_is_free(boxes, grid, lower, upper, samples, first, j, clearance):
            best, reach = j, max(1, int(_GROWTH * (j - first)))
        else:
            failed = j
    return best, trials


# Cover a path with boxes that are proved free by over-sweeps; consecutive boxes overlap.

LEVELS = ((0.015, 0.004), (0.004, 0.001), (0.001, 0.0003))
"""Padding of a box in every angle and joint [rad or m], and clearance that it needs at both ends [m]: with
wider paddings boxes would hold less of the path."""

SMALLEST_LEVELS = (*LEVELS, (0.0003, 0.0001), (0.00003, 0.00001))
"""``LEVELS`` and further levels, for passages of a tenth of a millimetre [rad or m, m]."""

SPACING = 0.02
"""Distance between samples of a path in any scaled axis [m]: a box ends at a sample."""

FINEST_SPACING, SMALLEST_SPACING = 0.002, 0.00004
"""Samples closer than this are not refined any more [m]; the second one belongs to ``SMALLEST_LEVELS``."""

REFINEMENT = 4
"""Where no box holds two consecutive samples, so many intervals take the place of one."""

FIRST_REACH = 4
"""Samples in the first box that is tried, before the length of any box is known."""


def free_boxes(
    tree: ComponentTree,
    workspace: Polygon | MultiPolygon,
    scale: FloatArray,
    path: FloatArray,
    *,
    smallest: bool = False,
) -> tuple[list[FreeBox] | None, int]:
    """Cover a path with boxes, from its first to its last configuration.

    Every box is proved free: its over-swept footprint touches no wall along the path, and no bodies touch.
    Consecutive boxes share a sample of the path, padded in every angle. Where no box holds two consecutive
    samples, the path is sampled more closely. Levels wider than that of the box before by more than one are
    not tried: they would fail in narrow passages again and again.

    Args:
        tree: The team.
        workspace: Where the team may be [m].
        scale: How far a unit of each axis of z moves the team, shape (3 + n,).
        path: Configurations with circular axes unwrapped, the first one free, shape (m, 3 + n).
        smallest: Whether boxes may be as small as a passage of a millimetre needs; a transport through them
            takes long.

    Returns:
        The boxes, or None if a part of the path cannot be covered, and how many boxes were tried.
    """
    levels, finest = (SMALLEST_LEVELS, SMALLEST_SPACING) if smallest else (LEVELS, FINEST_SPACING)
    arrays, grid = box_arrays(tree), grid_inside(workspace, tree.reach)
    samples, found = densified(path, scale, SPACING), list[FreeBox]()
    i, reach, widest, trials = 0, FIRST_REACH, 0, 0
    while i < len(samples) - 1:
        for level in range(max(widest - 1, 0), len(levels)):
            pad, clearance = levels[level]
            last, tried = longest_box(arrays, grid, samples, i, reach, pad, clearance)
            trials, reach = trials + tried, max(1, last - i)
            if last > i:
                lower, upper = padded(arrays, samples, i, last, pad)
                found.append(FreeBox(Polygon(), lower, upper, samples[i : last + 1, :2].copy()))
                i, widest = last, level
                break
        else:
            if np.abs((samples[i + 1] - samples[i]) * scale).max() < finest:
                return None, trials
            samples = _finer(samples, i)
    return found, trials


def _finer(samples: FloatArray, i: int) -> FloatArray:
    """Samples with more of them between sample i and the next one."""
    fraction = np.arange(1, REFINEMENT)[:, None] / REFINEMENT
    between = samples[i] + fraction * (samples[i + 1] - samples[i])
    return np.concatenate((samples[: i + 1], between, samples[i + 1 :]))


def box_arrays(tree: ComponentTree) -> BoxArrays:
    """Arrays of a team for the compiled boxes; a piece that several collision pairs need is swept once."""
    rows = tree.arrays.pairs.tolist()
    needed = {(i, stages) for i, _, stages, _ in rows} | {(j, stages) for _, j, _, stages in rows}
    sweeps = sorted(needed, key=lambda sweep: (-sweep[0], sweep[1]))
    row = {sweep: k for k, sweep in enumerate(sweeps)}
    infinite = np.array([np.inf])
    return BoxArrays(
        tree.arrays,
        _table(sweeps),
        _table([(row[i, first], row[j, second]) for i, j, first, second in rows]),
        np.concatenate((-infinite, tree.joint_lower)),
        np.concatenate((infinite, tree.joint_upper)),
    )


def _table(rows: Sequence[tuple[int, int]]) -> IntArray:
    return np.array(rows, dtype=np.int64).reshape(-1, 2)
