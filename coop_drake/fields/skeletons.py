"""Recursive skeletonization: solves the boundary integral equation in almost linear time.

The interaction of neighbouring nodes with the rest of the boundary has a low rank. Clusters of nodes are
solved on their own, compressed to skeletons (few of their nodes that represent all), merged with their
neighbours and compressed again (Martinsson and Rokhlin, 2005; Ho and Greengard, 2012), until the rest is a
small dense system. Harmonic polynomials represent everything that is far from a cluster, so that no step
looks beyond its surroundings.

In every cluster sigma = S (g - phi): phi is the field that comes in from outside, S the scattering matrix.

What it brings, beside one dense system of all nodes (benchmark `mapping/ablation/skeletons`; one thread, CPU
time and peak memory of the process; the residuals are equal to two digits):

| domain | unknowns | compressed | dense |
|---|---|---|---|
| maze, 56 corners | 5,447 | 1.1 s, 0.33 GB | 4.8 s, 0.90 GB |
| room of 300 corners | 11,440 | 1.4 s, 0.38 GB | 32 s, 3.3 GB |
| maze, 120 corners | 11,713 | 2.8 s, 0.42 GB | 35 s, 3.4 GB |
| room of 1,000 corners | 38,363 | 5.8 s, 0.66 GB | the matrix alone has 12 GB |
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # It imports its parts when they are first used: maps from the cache need none.

from coop_drake.fields.double_layer import DoubleLayer, block, mark_near
from coop_drake.tree.pose import FloatArray, IntArray

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
class Cluster:
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

    parts: list[Cluster]
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


def solve_clusters(
    layer: DoubleLayer, atoms: list[Cluster], hole: IntArray, length: FloatArray
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


def _divide(layer: DoubleLayer, atoms: list[Cluster]) -> list[list[Cluster]]:
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


def _gauge(groups: list[list[Cluster]], hole: IntArray, length: FloatArray) -> FloatArray:
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


@dataclass(frozen=True)
class _Skeletons:
    """Interpolation between a cluster and its skeletons.

    Attributes:
        rows: Places of the target skeleton among the cluster's rows.
        expansion: From the field on it to that on all rows.
        columns: Places of the source skeleton among the cluster's columns.
        condensation: From all columns to it.
    """

    rows: IntArray
    expansion: FloatArray
    columns: IntArray
    condensation: FloatArray


def _compress(
    layer: DoubleLayer, group: list[Cluster], rows: IntArray, columns: IntArray, scratch: IntArray
) -> _Skeletons:
    """Skeletons of a group within all rows and columns that are left."""
    own_rows = np.concatenate([part.rows for part in group])
    own_columns = np.concatenate([part.columns for part in group])
    own = np.concatenate((own_rows, own_columns))
    x, y = layer.x[own], layer.y[own]
    centre = complex(0.5 * (x.min() + x.max()), 0.5 * (y.min() + y.max()))
    radius = _RADIUS * float(np.hypot(x - centre.real, y - centre.imag).max())
    sources, targets = mark_near(layer, own, (centre.real, centre.imag, radius), scratch)
    seen = block(layer, own_rows, columns[sources[columns]], scratch).T
    acted = block(layer, rows[targets[rows]], own_columns, scratch)
    far_in = _harmonics((layer.x + 1j * layer.y)[own_rows], centre, radius)
    element = (layer.dx + 1j * layer.dy)[own_columns] / radius
    far_out = _harmonics((layer.x + 1j * layer.y)[own_columns], centre, radius) * element
    row_skeleton, expansion = _interpolate(np.concatenate((seen, far_in.real, far_in.imag)))
    column_skeleton, condensation = _interpolate(np.concatenate((acted, far_out.real, far_out.imag)))
    return _Skeletons(row_skeleton, expansion.T, column_skeleton, condensation)


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
    layer: DoubleLayer,
    group: list[Cluster],
    gauge: FloatArray,
    skeletons: _Skeletons | None,
    scratch: IntArray,
) -> tuple[Cluster, float]:
    """Solve a group for everything that comes in through its skeletons; and the condition of its system."""
    rows = np.concatenate([part.rows for part in group])
    columns = np.concatenate([part.columns for part in group])
    coupling = np.ascontiguousarray(block(layer, rows, columns, scratch))
    for mean in gauge:
        coupling += np.outer(mean[rows] > 0.0, mean[columns])
    expansion = skeletons.expansion if skeletons is not None else np.empty((len(rows), 0))
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
        return Cluster(rows[:0], columns, None, response, inside), condition
    return (
        Cluster(
            rows[skeletons.rows],
            columns[skeletons.columns],
            skeletons.condensation @ incoming,
            skeletons.condensation @ response,
            inside,
        ),
        condition,
    )
