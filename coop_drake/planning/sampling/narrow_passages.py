"""Narrow-passage repair: a path for an easier question is moved until it answers the original one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.polygons import parts_of, polygon_rings
from coop_drake.geometry.sweeps import following
from coop_drake.jit import compiled
from coop_drake.planning.questions import nearby
from coop_drake.planning.sampling.band import clearances, improved
from coop_drake.planning.sampling.collision import densified, grid_for_team, is_free
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import TeamArrays, configuration_scale, moved, place_into

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Distances between what is near each other along a path, and how they change with the configurations.

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
    places, poses = np.empty((len(path), len(team.vertices), 2)), np.empty((len(team.links), 5))
    for k in range(len(path)):
        place_into(team, path[k], poses)
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
    radii = np.repeat(team.radii, team.pieces[:, 2] - team.pieces[:, 1])
    ring = _ring_order(team)
    own = _Vertices(vertices.places[:, ring], vertices.changes[:, ring])
    return _joined(
        _contacts(vertices, first, last, radii[:, None], near),
        _contacts(first, vertices, own, radii[None, :], near),
    )


def body_contacts(team: TeamArrays, path: FloatArray, near: float) -> Contacts:
    """Vertices of bodies near an edge of another body that must not touch; see ``wall_contacts``."""
    vertices, ring, found = _vertices(team, path), _ring_order(team), []
    for one, other in (*team.pairs[:, :2], *team.pairs[:, 1::-1]):
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


def _ring_order(team: TeamArrays) -> IntArray:
    """For each vertex the one that follows it in its piece, shape (V,)."""
    parts = [following(np.arange(first, last)) for _, first, last in team.pieces]
    return np.concatenate(parts).astype(np.int64)


def _joined(*contacts: Contacts) -> Contacts:
    return Contacts(*(np.concatenate(parts) for parts in zip(*contacts, strict=True)))


# A linear program that moves a path such that its least distance from the walls becomes larger.
#
# Distances are linear in small moves. With as many walls touched as there are axes, random moves hardly
# ever lead away from all of them, and the program's solution does.

WIDE_ENOUGH = 0.003
"""A sample with this distance from the walls need not be moved further from them [m]."""

BESIDE = 2
"""So many samples beside those that are moved for their distance are moved, too."""

NEAR = 0.03
"""Distances up to this one are in the program [m]."""

BODY_GAP = 0.001
"""Distance that bodies of the team keep from each other, where they have it [m]."""

MEAN_WEIGHT = 0.3
"""Weight of the mean of all distances beside the least one's 1 [-]: wider places hold longer boxes."""


def with_wider_passages(
    problem: PlanningProblem, path: FloatArray, most: float, spacing: float
) -> FloatArray:
    """Move the samples near walls such that the least distance from the walls grows, to first order.

    The path's ends stay. That the result is free has to be tested.

    Args:
        problem: The question, on whose floor all samples are free.
        path: Samples, close together, circular axes unwrapped, shape (m, 3 + n).
        most: Largest move of a sample in any scaled axis [m].
        spacing: Largest distance of neighbours in any scaled axis that the moves may lead to [m].
    """
    from scipy import sparse  # Here: their imports take a tenth of a second.
    from scipy.optimize import Bounds, LinearConstraint, milp

    tree = problem.tree
    team, scale = tree.arrays, configuration_scale(tree)
    clear = clearances(team, grid_for_team(problem.workspace, team), path, WIDE_ENOUGH + NEAR)
    chosen = np.convolve(clear < WIDE_ENOUGH + most, np.ones(1 + 2 * BESIDE), "same") > 0.0
    chosen[[0, -1]] = False
    samples = path[chosen]
    if not len(samples):
        return path
    rings = polygon_rings(nearby(problem.workspace, samples[:, :2], tree.reach))
    edges = np.concatenate([np.hstack((ring, following(ring))) for ring in rings])
    walls = wall_contacts(team, samples, edges, NEAR)
    bodies = body_contacts(team, samples, NEAR)
    count, axes = samples.shape
    own, moves = sparse.eye_array(count, format="csr"), count * axes
    near = chosen[1:] | chosen[:-1]  # Neighbours of which one moves at least.
    place, sides = np.cumsum(chosen) - 1, (slice(1, None), slice(None, -1))
    both = [sparse.diags_array(chosen[side][near] * 1.0) @ own[place[side][near]] for side in sides]
    between = (np.diff(path * scale, axis=0)[near]).ravel()
    far = np.maximum(spacing, np.abs(between))
    # Columns are scaled moves, clearances and the least of these.
    rows = sparse.block_array(
        [
            [_changes(walls, scale, count), -own[walls.rows], None],
            [_changes(bodies, scale, count), None, None],
            [None, own, sparse.csr_array(-np.ones((count, 1)))],
            [sparse.kron(both[0] - both[1], sparse.eye_array(axes)), None, None],
        ],
        format="csr",
        dtype=np.float64,
    )
    least = [-walls.distances, np.minimum(bodies.distances, BODY_GAP) - bodies.distances, np.zeros(count)]
    free = np.full(sum(map(len, least)), np.inf)
    constraint = LinearConstraint(
        rows, np.concatenate([*least, -far - between]), np.concatenate([free, far - between])
    )
    lower, upper = np.full((count, axes), -most), np.full((count, axes), most)
    lower[:, 3:] = np.clip((tree.joint_lower - samples[:, 3:]) * scale[3:], -most, 0.0)
    upper[:, 3:] = np.clip((tree.joint_upper - samples[:, 3:]) * scale[3:], 0.0, most)
    widest = np.full(count + 1, WIDE_ENOUGH)
    cost = np.concatenate([np.zeros(moves), np.full(count, -MEAN_WEIGHT / count), [-1.0]])
    bounds = Bounds(np.append(lower, -widest), np.append(upper, widest))
    solved = milp(cost, bounds=bounds, constraints=constraint)
    better = path.copy()
    if solved.x is not None:
        better[chosen] += solved.x[:moves].reshape(count, axes) / scale
    return better


def _changes(contacts: Contacts, scale: FloatArray, count: int) -> csr_array:
    """How scaled moves of samples change distances, a row for each contact, (M, samples times axes)."""
    from scipy.sparse import csr_array

    rows, axes = np.arange(len(contacts.rows)), np.arange(len(scale))
    places = np.broadcast_arrays(rows[:, None], contacts.rows[:, None] * len(scale) + axes)
    entries = (contacts.gradients / scale).ravel(), tuple(part.ravel() for part in places)
    return csr_array(entries, shape=(len(rows), count * len(scale)))


LEAST_BODY_GAP = 0.002
"""Distance that bodies of the team keep from each other [m]."""

PRICES = (0.04, 5e-4, 0.1)
"""A sample with clearance c costs [0] / ([1] + min(c, [2])) [m]: steep, so the narrowest place counts."""

REPAIR_SPACING = 0.05
"""Distance between samples of a path in any scaled axis [m]."""

MOVES = 2_000
"""Changes of a path that are tried at a time."""

WINDOW = 40
"""Later changes are confined to this many samples on each side of the narrowest one: two metres of path."""

HALVINGS = 10
"""Bisections of an amount: the result is exact to a thousandth of the amount."""

ROUNDS_OF_MOVES = 6
"""Times that a path is moved before it is given up."""

REPAIRS = 3
"""Times that this is repeated while it helps."""

LEAST_CLEARANCE = 0.001
"""Walls are moved in by this, so that boxes around the repaired path have a width [m]."""

MITRE_LIMIT = 5.0
"""Corners of a widened floor are cut at this many times the widening [-]."""

FINE_SPACINGS = (0.02, 0.005)
"""Distances between samples of a path that is moved to the middle of its narrowest passages, in any scaled
axis [m]: a turn by 5 mm between two samples lifts a point by 5 um off the line between them."""

CHORD = 0.001
"""Between samples of a path it needs at most this much more easing than at them [m]."""

LARGEST_MOVE, SMALLEST_MOVE, SHORTER = 0.01, 2e-5, 0.3
"""Moves of samples that are tried, the largest first, and the factor between them [m, m, -]."""

STRETCH = 1.5
"""Samples may move apart up to this many spacings [-]."""

LEAST_GAIN = 1e-6
"""Moves that ease a path by less are of no use [m]."""

SOLVED_FRACTION = 0.1
"""A path is repaired when it needs less than this fraction of ``LEAST_CLEARANCE`` [-]."""

PROGRESS_FRACTION = 0.8
"""Repairs go on while the amount needed falls below this fraction of the amount before [-]."""

Eased = Callable[[float], PlanningProblem]
"""The question made easier by an amount; what is free for one amount is free for every larger one."""


def ease_less(eased: Eased, path: FloatArray, amount: float, enough: float = 0.0) -> tuple[FloatArray, float]:
    """Move a path such that it is free for a smaller amount of easing.

    The first moves are anywhere on the path, later ones near the place that needs the largest amount.

    Args:
        eased: The question made easier by an amount.
        path: A path that is free with ``amount``, circular axes unwrapped, shape (m, 3 + n).
        amount: The amount.
        enough: Amount at which it may stop.

    Returns:
        The path, and the amount with which all its samples are free; this is measured and proves nothing.
    """
    path = densified(path, configuration_scale(eased(amount).tree), REPAIR_SPACING)
    needed, worst = amount_needed(eased, path, amount)
    for number in range(ROUNDS_OF_MOVES):
        if needed <= enough:
            break
        here = slice(max(0, worst - WINDOW), worst + WINDOW + 1) if number else slice(None)
        last = here.stop is None or here.stop >= len(path)
        part = with_larger_least_clearance(eased(needed), path[here], number, free_end=last)
        moved = np.concatenate((path[: here.start or 0], part, path[len(path) if last else here.stop :]))
        less, at = amount_needed(eased, moved, needed)
        if less <= needed:
            path, needed, worst = moved, less, at
    return path, needed


def with_larger_least_clearance(
    problem: PlanningProblem, path: FloatArray, seed: int, *, free_end: bool
) -> FloatArray:
    """Move a free path such that its smallest clearance becomes larger.

    Args:
        problem: The question.
        path: Samples, close together, shape (m, 3 + n).
        seed: Seed of the random moves.
        free_end: Whether the path ends at the goal, where free joints may move.
    """
    rate, scale = np.array(PRICES), configuration_scale(problem.tree)
    return improved(
        problem, problem.workspace, path, rate, scale, LEAST_BODY_GAP, MOVES, seed, free_end=free_end
    )


def amount_needed(eased: Eased, path: FloatArray, most: float) -> tuple[float, int]:
    """Smallest amount, up to ``most``, with which all samples are free, and the sample that needs it."""
    lower, upper, worst = 0.0, most, 0
    for _ in range(HALVINGS):
        middle = 0.5 * (lower + upper)
        free = are_free(eased(middle), path)
        if free.all():
            upper = middle
        else:
            lower, worst = middle, int(np.argmin(free))
    return upper, worst


def are_free(problem: PlanningProblem, path: FloatArray) -> NDArray[np.bool_]:
    """Whether each sample is within limits and free of collisions; exact, shape (m,)."""
    team = problem.tree.arrays
    grid = grid_for_team(problem.workspace, team)
    free: NDArray[np.bool_] = np.array([is_free(team, grid, z, 0.0) for z in path])
    return free & _within_limits(problem, path)


def _within_limits(problem: PlanningProblem, path: FloatArray) -> NDArray[np.bool_]:
    """Whether all joints of each sample are within their limits, shape (m,)."""
    lower, upper = problem.tree.joint_lower, problem.tree.joint_upper
    within: NDArray[np.bool_] = np.all((path[:, 3:] >= lower) & (path[:, 3:] <= upper), axis=1)
    return within


def widened_floor(workspace: Polygon, amount: float) -> MultiPolygon:
    """Workspace with all walls moved back by an amount [m]; walls thinner than twice as much disappear."""
    grown = workspace.buffer(amount, join_style="mitre", mitre_limit=MITRE_LIMIT)
    return MultiPolygon(parts_of(grown))


def repaired(problem: PlanningProblem, path: FloatArray, growth: float) -> tuple[FloatArray, float]:
    """Move a path for a larger floor until all its samples are free on the original floor.

    Args:
        problem: The question.
        path: A path on the floor widened by ``growth``, circular axes unwrapped, shape (m, 3 + n).
        growth: How far walls were moved back for it [m].

    Returns:
        The path, and how far walls have to be moved back for all its samples, zero or less where they need
        not [m]. Samples prove nothing: boxes have to cover it.
    """
    eased, needed = _eased(problem), growth + LEAST_CLEARANCE
    for _ in range(REPAIRS):
        before = needed
        path, needed = ease_less(eased, path, needed, enough=SOLVED_FRACTION * LEAST_CLEARANCE)
        if needed <= SOLVED_FRACTION * LEAST_CLEARANCE or needed > PROGRESS_FRACTION * before:
            break
    return path, needed - LEAST_CLEARANCE


def centred(problem: PlanningProblem, path: FloatArray, short: float) -> tuple[FloatArray, float]:
    """Move a path to the middle of its narrowest passages by linear programs.

    Args:
        problem: The question.
        path: A path that is free with walls moved back by ``short``, circular axes unwrapped, shape
            (m, 3 + n).
        short: That distance; negative where they are moved in, by up to ``LEAST_CLEARANCE`` [m].

    Returns:
        The path with samples added, and the distance with which all of them are free.
    """
    eased, scale, amount = _eased(problem), configuration_scale(problem.tree), short + LEAST_CLEARANCE
    for spacing in FINE_SPACINGS:
        path = densified(path, scale, spacing)
        amount, _ = amount_needed(eased, path, amount + CHORD)
        move = LARGEST_MOVE
        while move > SMALLEST_MOVE:
            moved = with_wider_passages(eased(amount), path, move, STRETCH * spacing)
            less, _ = amount_needed(eased, moved, amount)
            if amount - less > LEAST_GAIN:
                path, amount = moved, less
            else:
                move *= SHORTER
        if amount > LEAST_CLEARANCE + CHORD:
            break
    return path, amount - LEAST_CLEARANCE


def _eased(problem: PlanningProblem) -> Eased:
    """The question with walls moved back by an amount less ``LEAST_CLEARANCE``."""

    def eased(amount: float) -> PlanningProblem:
        floor = problem.workspace.buffer(amount - LEAST_CLEARANCE, join_style="mitre")
        return replace(problem, workspace=floor)

    return eased
