"""Solves the boundary integral equation of one map, in almost linear time.

With the complex density mu and the domain on the left of every ring,

    T(z) = Re (1 / 2 pi i) oint mu dt / (t - z),  for the real and the imaginary part of mu,

is harmonic, single-valued, and has no flux around any hole. On the boundary

    mu + 2 K mu - 2 c_k [on hole k] = 2 g,    a mean of mu over hole k = 0,

K the double layer, g = exp(i angle) on the outer ring and 0 on holes; hole k collapses to the point c_k.
Adding a constant to mu on a hole changes c_k alone, so any mean may be used.

The interaction of neighbouring nodes with the rest of the boundary has a low rank. Clusters of nodes are
solved on their own, compressed to skeletons (few of their nodes that represent all), merged with their
neighbours and compressed again (Martinsson and Rokhlin, 2005; Ho and Greengard, 2012), until the rest is a
small dense system. Harmonic polynomials represent everything that is far from a cluster, so that no step
looks beyond its surroundings. In every cluster sigma = S (g - phi): phi is the field that comes in from
outside, S the scattering matrix. Up to `DENSE` unknowns there is one dense system, as quick and simpler; a
room of 300 corners takes 1.4 s of CPU time and 0.4 GB instead of 32 s and 3.3 GB.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from math import pi
from typing import NamedTuple

import numpy as np
import scipy  # It imports its parts when they are first used: maps from the cache need none.
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

from coop_drake.harmonic_maps.outline import Outline
from coop_drake.harmonic_maps.panels import Nodes, Panels, corner_operator, legendre_transform, place_nodes
from coop_drake.jit import compiled
from coop_drake.tree.arrays import ComplexArray, FloatArray, IntArray

CLOSE = 4.3
"""|zeta - 1| + |zeta + 1| below which panels are integrated exactly, zeta the target in a panel's coordinate
[-]."""
DENSE = 1_500
"""Unknowns up to which one dense system is as fast; below it nothing is compressed."""
_LEAF = 160
"""Nodes of a smallest cluster: smaller ones cost more in Python than they save in arithmetic."""
_RADIUS = 2.0
"""Radius of the disc whose nodes count as near a cluster, per radius of the cluster [-]."""
_ORDER = 42
"""Degree of the harmonic polynomials: beyond two radii the rest is 2^-42, about the tolerance."""
_TOLERANCE = 1e-12
"""Error of the interpolation between nodes, relative to the largest entry [-]."""


@dataclass(frozen=True)
class Density:
    """Solution of the integral equation.

    Attributes:
        nodes: Where the equation was solved.
        weighted: Density at the nodes, weight-corrected in corner blocks, shape (n, 2).
        hole_images: c_k, shape (holes, 2).
        condition: Largest condition number of a system that was factorised, estimated in the 1-norm.
    """

    nodes: Nodes
    weighted: FloatArray
    hole_images: FloatArray
    condition: float


def solve_density(
    outline: Outline, panels: Panels, angles: FloatArray, nodes: int, closeness: float
) -> Density:
    """Solve for the density with ``nodes`` Gauss nodes a panel; arguments as in `place_nodes`."""
    grid = place_nodes(outline, panels, angles, nodes, closeness)
    holes, ring = outline.holes, outline.ring[grid.edge]
    tangent = (outline.ends - outline.vertices)[panels.edge]
    tangent = tangent / np.abs(tangent)
    middle, half = 0.5 * (panels.end + panels.start), 0.5 * (panels.end - panels.start)
    segments = np.column_stack((outline.vertices[panels.edge] + middle * tangent, half * tangent))
    layer = _double_layer(grid, segments, panels.edge, nodes)
    on_hole = (ring[:, None] == np.arange(1, holes + 1)).astype(float)
    g = grid.boundary_value
    right = np.column_stack((2.0 * g.real, 2.0 * g.imag, on_hole))
    blocks = [_corner_block(float(angle), nodes, closeness) for angle in angles]
    # On few cores a threaded factorisation of these sizes is slower.
    with _threads().limit(limits=1, user_api="blas"):
        atoms = _atoms(grid.corner_start, blocks, nodes, right)
        sigma, means, condition = _solve_clusters(layer, atoms, ring - 1, np.abs(grid.element))
        balance = means @ sigma
        constants = np.asarray(-np.linalg.solve(balance[:, 2:], balance[:, :2]), dtype=float)
        weighted = np.ascontiguousarray(sigma[:, :2] + sigma[:, 2:] @ constants)
    return Density(grid, weighted, 0.5 * constants, condition)


def _atoms(corner_start: IntArray, blocks: list[FloatArray], nodes: int, right: FloatArray) -> list[_Cluster]:
    """The smallest clusters: corner blocks and regular panels."""
    atoms = []
    for start, corner in zip(corner_start, blocks, strict=False):
        own = np.arange(start, start + len(corner))
        atoms.append(_Cluster(own, own, corner, corner @ right[own]))
    for start in range(int(corner_start[-1]), len(right), nodes):
        own = np.arange(start, start + nodes)
        atoms.append(_Cluster(own, own, None, right[own]))
    return atoms


@lru_cache(maxsize=4096)
def _corner_block(angle: float, nodes: int, closeness: float) -> FloatArray:
    """R of one corner on its incoming and outgoing leg together."""
    even, odd = corner_operator(angle, nodes, closeness).compressed
    same, other = 0.5 * (even + odd), 0.5 * (even - odd)
    return np.block([[same, other], [other, same]])


@cache
def _threads() -> ThreadpoolController:
    return ThreadpoolController()


class _DoubleLayer(NamedTuple):
    """The data from which the entries of 2 K on the nodes of a boundary are computed.

    Entries of two nodes on one edge are exactly zero; so are, by convention, those of two nodes of one corner
    block, whose interaction is part of the block's compressed operator.

    Attributes:
        x: Nodes [m], shape (n,).
        y: Nodes [m], shape (n,).
        dx: Line element times weight, over pi [m], shape (n,).
        dy: Line element in y times weight, over pi [m], shape (n,).
        edge: Edge of each node, shape (n,).
        corner: Corner block of each node, -1 on regular panels, shape (n,).
        first: First node of the regular panels, shape (1,).
        pair_start: First near pair of each regular panel, and one more, shape (panels + 1,).
        pair_target: Node of each near pair, shape (pairs,).
        pair_weight: The weights that replace the kernel of its panel there, shape (pairs, nodes of a panel).
    """

    x: FloatArray
    y: FloatArray
    dx: FloatArray
    dy: FloatArray
    edge: IntArray
    corner: IntArray
    first: IntArray
    pair_start: IntArray
    pair_target: IntArray
    pair_weight: FloatArray


def _double_layer(grid: Nodes, segments: ComplexArray, panel_edge: IntArray, nodes: int) -> _DoubleLayer:
    """Prepare 2 K of a discretisation, with so many Gauss nodes on a panel.

    Segments are centre and half vector of each regular panel, shape (panels, 2).
    """
    start, target, weight = _near_pairs(
        grid.position, grid.edge, segments, panel_edge, legendre_transform(nodes)
    )
    return _DoubleLayer(
        x=grid.position.real.copy(),
        y=grid.position.imag.copy(),
        dx=grid.element.real / pi,
        dy=grid.element.imag / pi,
        edge=grid.edge,
        corner=grid.corner,
        first=grid.corner_start[-1:],
        pair_start=start,
        pair_target=target,
        pair_weight=weight,
    )


@compiled
def _block(k: _DoubleLayer, rows: IntArray, columns: IntArray, row_of: IntArray) -> FloatArray:
    """Entries of 2 K at ``rows``, the targets, x ``columns``, the sources, stored column by column.

    ``row_of`` is scratch of shape (n,), -1 throughout before and after.
    """
    m = len(rows)
    x, y, edge, corner = k.x[rows], k.y[rows], k.edge[rows], k.corner[rows]
    out = np.empty((len(columns), m))
    for b in range(len(columns)):
        j = columns[b]
        tx, ty, dx, dy, e = k.x[j], k.y[j], k.dx[j], k.dy[j], k.edge[j]
        c = k.corner[j] if k.corner[j] >= 0 else -2
        for a in range(m):
            rx, ry = tx - x[a], ty - y[a]
            value = (dy * rx - dx * ry) / (rx * rx + ry * ry)
            out[b, a] = 0.0 if edge[a] == e or corner[a] == c else value
    for a in range(m):
        row_of[rows[a]] = a
    first, p = k.first[0], k.pair_weight.shape[1]
    for b in range(len(columns)):
        j = columns[b] - first
        if j >= 0:
            for t in range(k.pair_start[j // p], k.pair_start[j // p + 1]):
                a = row_of[k.pair_target[t]]
                if a >= 0:
                    out[b, a] = k.pair_weight[t, j % p]
    for a in range(m):
        row_of[rows[a]] = -1
    return out.T


def _mark_near(
    k: _DoubleLayer, own: IntArray, centre: complex, radius: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Mark the nodes outside a set but not far from it: as sources on the set, and as its targets.

    These are the nodes in a disc around the set [m], and those whose entry with a node of the set has exact
    weights; masks of shape (n,), False on the set itself.
    """
    inside = np.zeros(len(k.x), dtype=np.bool_)
    inside[own] = True
    sources = (k.x - centre.real) ** 2 + (k.y - centre.imag) ** 2 < radius * radius
    targets = sources.copy()
    panel = np.repeat(np.arange(len(k.pair_start) - 1), np.diff(k.pair_start))
    first, p = k.first[0], k.pair_weight.shape[1]
    held: NDArray[np.bool_] = np.any(inside[first:].reshape(-1, p), axis=1)
    targets[k.pair_target[held[panel]]] = True
    sources[first:].reshape(-1, p)[panel[inside[k.pair_target]]] = True
    sources[own] = targets[own] = False
    return sources, targets


@compiled
def _near_pairs(
    target: ComplexArray, target_edge: IntArray, segments: ComplexArray, edge: IntArray, transform: FloatArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Find the targets near each regular panel but not on its edge, and the exact weights of the panel there.

    The weights are those of polynomial densities; ``transform`` leads from values at the nodes to Legendre
    coefficients.

    Returns:
        Where each panel's targets begin, and the end, shape (panels + 1,); the targets, shape (pairs,); and
        the weights, shape (pairs, nodes).
    """
    p = len(transform)
    start, found = np.zeros(len(segments) + 1, np.int64), np.empty(0, np.int64)
    moments, weights = np.empty(p), np.empty((0, p))
    for writing in range(2):
        end = 0
        for k in range(len(segments)):
            centre, half = segments[k, 0], segments[k, 1]
            reach = (0.5 * CLOSE) ** 2 * (half.real**2 + half.imag**2)
            for i in range(len(target)):
                rx, ry = target[i].real - centre.real, target[i].imag - centre.imag
                if rx * rx + ry * ry >= reach or target_edge[i] == edge[k]:
                    continue
                zeta = (target[i] - centre) / half
                if abs(zeta - 1.0) + abs(zeta + 1.0) >= CLOSE:
                    continue
                if writing == 1:
                    found[end] = i
                    legendre_moments(zeta, moments)
                    for degree in range(p):
                        for j in range(p):
                            weights[end, j] += moments[degree] * transform[degree, j]
                end += 1
            start[k + 1] = end
        if writing == 0:
            found, weights = np.empty(end, np.int64), np.zeros((end, p))
    return start, found, weights


@compiled(borrows=True)
def legendre_moments(zeta: complex, out: FloatArray) -> None:
    """1/pi times the imaginary part of the integral of P_k(x) / (x - zeta) over [-1, 1], k from 0."""
    turn = np.arctan2(zeta.imag, zeta.real + 1.0) - np.arctan2(zeta.imag, zeta.real - 1.0)
    q0 = complex(0.5 * np.log(abs(zeta + 1.0) / abs(zeta - 1.0)), 0.5 * turn)
    q1 = zeta * q0 - 1.0
    out[0], out[1] = -2.0 / pi * q0.imag, -2.0 / pi * q1.imag
    for k in range(1, len(out) - 1):
        q0, q1 = q1, ((2 * k + 1) * zeta * q1 - k * q0) / (k + 1)
        out[k + 1] = -2.0 / pi * q1.imag


@dataclass(frozen=True)
class _Cluster:
    """A part of the boundary as the rest of it sees it; corner blocks and panels are clusters without parts.

    Attributes:
        rows: Nodes where the incoming field determines it on all of the cluster.
        columns: Nodes whose density represents that on all of the cluster.
        scattering: S from ``rows`` to ``columns``, None for the identity.
        response: S g on ``columns``, a column for each right-hand side.
        inside: How the solution on its parts follows from its incoming field.
    """

    rows: IntArray
    columns: IntArray
    scattering: FloatArray | None
    response: FloatArray
    inside: _Inside | None = None

    def scattered(self, field: FloatArray) -> FloatArray:
        """Multiply fields on the rows by S."""
        return field if self.scattering is None else self.scattering @ field


@dataclass(frozen=True)
class _Inside:
    """The parts of a cluster and the factors that solve for them.

    Attributes:
        parts: The clusters that were merged.
        response: sigma on all columns of the parts if no field comes in.
        incoming: What is subtracted from it per field on the cluster's rows.
        expansion: Field on all rows of the parts per field on the cluster's.
        coupling: 2 K between the parts.
    """

    parts: list[_Cluster]
    response: FloatArray
    incoming: FloatArray
    expansion: FloatArray
    coupling: FloatArray

    def spread(self, field: FloatArray, sigma: FloatArray) -> None:
        """Write sigma on all nodes of the cluster, given the incoming field on its rows."""
        x = self.response - self.incoming @ field
        fields = self.coupling @ x + self.expansion @ field
        first = place = 0
        for part in self.parts:
            own = slice(first, first + len(part.rows))
            if part.inside is None:
                sigma[part.columns] = x[place : place + len(part.columns)]
            else:
                part.inside.spread(fields[own], sigma)
            first, place = own.stop, place + len(part.columns)


def _solve_clusters(
    layer: _DoubleLayer, atoms: list[_Cluster], hole: IntArray, length: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Solve sigma + S (2 K + gauge) sigma = S g for all right-hand sides.

    Without the gauge sigma is undetermined by a constant on every hole. The gauge of a hole is the mean of
    sigma over the part of the hole that lies in one of the smallest clusters, acting on that part.

    Args:
        layer: 2 K.
        atoms: Corner blocks and panels, together all nodes.
        hole: Hole of each node counted from 0, -1 on the outer ring, shape (n,).
        length: Line element of each node, shape (n,).

    Returns:
        sigma, shape (n, right-hand sides); the gauge's means as rows of weights, shape (holes, n); the
        largest condition of a system that was factorised, estimated in the 1-norm.
    """
    groups = _divide(layer, atoms)
    means = gauge = _gauge(groups, hole, length)
    scratch = np.full(len(layer.x), -1)
    condition = 1.0
    while True:
        merged = []
        rows = np.concatenate([part.rows for group in groups for part in group])
        columns = np.concatenate([part.columns for group in groups for part in group])
        for group in groups:
            skeletons = _compress(layer, group, rows, columns, scratch) if len(groups) > 1 else None
            cluster, estimate = _merge(layer, group, gauge, skeletons, scratch)
            merged.append(cluster)
            condition = max(condition, estimate)
        if len(merged) == 1:
            break
        last = sum(len(cluster.columns) for cluster in merged) <= DENSE
        size = len(merged) if last else 2
        groups = [merged[k : k + size] for k in range(0, len(merged), size)]
        gauge = gauge[:0]
    sigma = np.empty((len(layer.x), atoms[0].response.shape[1]))
    assert merged[0].inside is not None
    merged[0].inside.spread(np.empty((0, sigma.shape[1])), sigma)
    return sigma, means, condition


def _divide(layer: _DoubleLayer, atoms: list[_Cluster]) -> list[list[_Cluster]]:
    """Halve the atoms along the longer side of their bounding box, as often for all of them."""
    size = np.array([len(atom.rows) for atom in atoms])
    centre = np.array([(layer.x[atom.rows].mean(), layer.y[atom.rows].mean()) for atom in atoms])
    groups = [np.arange(len(atoms))]
    halvings = 0 if size.sum() <= DENSE else int(np.ceil(np.log2(size.sum() / _LEAF)))
    for _ in range(halvings):
        halves = []
        for group in groups:
            axis = int(np.argmax(np.ptp(centre[group], axis=0)))
            ordered = group[np.argsort(centre[group, axis], kind="stable")]
            filled = np.cumsum(size[ordered])
            cut = int(np.searchsorted(filled, 0.5 * filled[-1]))
            halves += [half for half in (ordered[:cut], ordered[cut:]) if len(half) > 0]
        groups = halves
    return [[atoms[k] for k in group] for group in groups]


def _gauge(groups: list[list[_Cluster]], hole: IntArray, length: FloatArray) -> FloatArray:
    """Weights of the mean over the longest part of each hole in one group, shape (holes, n)."""
    means = np.zeros((int(hole.max()) + 1, len(hole)))
    group_of = np.empty(len(hole), dtype=np.int64)
    for index, group in enumerate(groups):
        group_of[np.concatenate([atom.rows for atom in group])] = index
    for k in range(len(means)):
        on_hole = np.flatnonzero(hole == k)
        parts = np.bincount(group_of[on_hole], weights=length[on_hole])
        chosen = on_hole[group_of[on_hole] == int(np.argmax(parts))]
        means[k, chosen] = length[chosen] / length[chosen].sum()
    return means


_Skeletons = tuple[IntArray, FloatArray, IntArray, FloatArray]
"""Places of the target skeleton among a cluster's rows, and from the field on it to that on all rows; places
of the source skeleton among its columns, and from all columns to it."""


def _compress(
    layer: _DoubleLayer, group: list[_Cluster], rows: IntArray, columns: IntArray, scratch: IntArray
) -> _Skeletons:
    """Skeletons of a group within all rows and columns that are left: see `_Skeletons`."""
    own_rows = np.concatenate([part.rows for part in group])
    own_columns = np.concatenate([part.columns for part in group])
    own = np.concatenate((own_rows, own_columns))
    x, y = layer.x[own], layer.y[own]
    centre = complex(0.5 * (x.min() + x.max()), 0.5 * (y.min() + y.max()))
    radius = _RADIUS * float(np.hypot(x - centre.real, y - centre.imag).max())
    sources, targets = _mark_near(layer, own, centre, radius)
    seen = _block(layer, own_rows, columns[sources[columns]], scratch).T
    acted = _block(layer, rows[targets[rows]], own_columns, scratch)
    far_in = _harmonics((layer.x + 1j * layer.y)[own_rows], centre, radius)
    element = (layer.dx + 1j * layer.dy)[own_columns] / radius
    far_out = _harmonics((layer.x + 1j * layer.y)[own_columns], centre, radius) * element
    row_skeleton, expansion = _interpolate(np.concatenate((seen, far_in.real, far_in.imag)))
    column_skeleton, condensation = _interpolate(np.concatenate((acted, far_out.real, far_out.imag)))
    return row_skeleton, expansion.T, column_skeleton, condensation


def _harmonics(z: np.ndarray, centre: complex, radius: float) -> np.ndarray:
    """Powers of (z - centre) / radius, one row each."""
    return np.vander((z - centre) / radius, _ORDER, increasing=True).T


def _interpolate(matrix: FloatArray) -> tuple[IntArray, FloatArray]:
    """Columns that all others follow from, and how: matrix = matrix[:, chosen] @ weights."""
    if len(matrix) > matrix.shape[1]:
        matrix = np.asarray(np.linalg.qr(matrix, mode="r"), dtype=float)
    triangle, order = scipy.linalg.qr(matrix, mode="r", pivoting=True, check_finite=False, overwrite_a=True)
    size = np.abs(np.diagonal(triangle))
    rank = max(int(np.count_nonzero(size > _TOLERANCE * size[0])), 1)
    weights = np.zeros((rank, matrix.shape[1]))
    weights[:, order[:rank]] = np.eye(rank)
    weights[:, order[rank:]] = scipy.linalg.solve_triangular(
        triangle[:rank, :rank], triangle[:rank, rank:], check_finite=False
    )
    return order[:rank].astype(np.int64), weights


def _merge(
    layer: _DoubleLayer,
    group: list[_Cluster],
    gauge: FloatArray,
    skeletons: _Skeletons | None,
    scratch: IntArray,
) -> tuple[_Cluster, float]:
    """Solve a group for everything that comes in through its skeletons; and the condition of its system."""
    rows = np.concatenate([part.rows for part in group])
    columns = np.concatenate([part.columns for part in group])
    coupling = np.ascontiguousarray(_block(layer, rows, columns, scratch))
    for mean in gauge:
        coupling += np.outer(mean[rows] > 0.0, mean[columns])
    expansion = skeletons[1] if skeletons is not None else np.empty((len(rows), 0))
    system = np.empty((len(columns), len(columns)), order="F")
    scattered = np.empty((len(columns), expansion.shape[1]))
    row = column = 0
    for part in group:
        r, c = slice(row, row + len(part.rows)), slice(column, column + len(part.columns))
        if part.inside is not None:
            coupling[r, c] = 0.0  # is in its scattering matrix
        system[c], scattered[c] = part.scattered(coupling[r]), part.scattered(expansion[r])
        row, column = r.stop, c.stop
    system[np.diag_indices(len(system))] += 1.0
    norm = float(np.abs(system).sum(axis=0).max())
    response = np.concatenate([part.response for part in group])
    factors = scipy.linalg.lu_factor(system, overwrite_a=True, check_finite=False)
    reciprocal, _ = scipy.linalg.lapack.dgecon(factors[0], norm)
    condition = 1.0 / max(float(reciprocal), 1e-300)
    solution = scipy.linalg.lu_solve(factors, np.hstack((response, scattered)), check_finite=False)
    response, incoming = solution[:, : response.shape[1]], solution[:, response.shape[1] :]
    inside = _Inside(group, response, incoming, expansion, coupling)
    if skeletons is None:
        return _Cluster(rows[:0], columns, None, response, inside), condition
    return (
        _Cluster(
            rows[skeletons[0]],
            columns[skeletons[2]],
            skeletons[3] @ incoming,
            skeletons[3] @ response,
            inside,
        ),
        condition,
    )
