"""Assembles and solves the boundary integral equation of one map.

With the complex density mu and the domain on the left of every ring,

    T(z) = Re (1 / 2 pi i) oint mu dt / (t - z),  for the real and the imaginary part of mu,

is harmonic, single-valued, and has no flux around any hole. On the boundary

    mu + 2 K mu - 2 c_k [on hole k] = 2 g,    a mean of mu over hole k = 0,

K the double layer, g = exp(i angle) on the outer ring and 0 on holes; hole k collapses to the point c_k.
Adding a constant to mu on a hole changes c_k alone, so any mean may be used.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

from coop_drake.fields.corners import corner_operator
from coop_drake.fields.double_layer import double_layer
from coop_drake.fields.nodes import Nodes, place_nodes
from coop_drake.fields.outline import Outline
from coop_drake.fields.panels import Panels
from coop_drake.fields.skeletons import Cluster, solve_clusters
from coop_drake.tree.pose import ComplexArray, FloatArray, IntArray


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
    segments = _segments(outline, panels)
    layer = double_layer(grid, segments, panels.edge, nodes)
    on_hole = (ring[:, None] == np.arange(1, holes + 1)).astype(float)
    g = grid.boundary_value
    right = np.column_stack((2.0 * g.real, 2.0 * g.imag, on_hole))
    blocks = [_corner_block(float(angle), nodes, closeness) for angle in angles]
    # On few cores a threaded factorisation of these sizes is slower.
    with _threads().limit(limits=1, user_api="blas"):
        atoms = _atoms(grid.corner_start, blocks, nodes, right)
        sigma, means, condition = solve_clusters(layer, atoms, ring - 1, np.abs(grid.element))
        balance = means @ sigma
        constants = np.asarray(-np.linalg.solve(balance[:, 2:], balance[:, :2]), dtype=float)
        weighted = np.ascontiguousarray(sigma[:, :2] + sigma[:, 2:] @ constants)
    return Density(grid, weighted, 0.5 * constants, condition)


def _atoms(corner_start: IntArray, blocks: list[FloatArray], nodes: int, right: FloatArray) -> list[Cluster]:
    """The smallest clusters: corner blocks and regular panels."""
    atoms = []
    for start, corner in zip(corner_start, blocks, strict=False):
        own = np.arange(start, start + len(corner))
        atoms.append(Cluster(own, own, corner, corner @ right[own]))
    for start in range(int(corner_start[-1]), len(right), nodes):
        own = np.arange(start, start + nodes)
        atoms.append(Cluster(own, own, None, right[own]))
    return atoms


def _segments(outline: Outline, panels: Panels) -> ComplexArray:
    """Centre and half vector of each regular panel, shape (panels, 2)."""
    start = outline.vertices[panels.edge]
    tangent = (outline.ends - outline.vertices)[panels.edge]
    tangent = tangent / np.abs(tangent)
    middle, half = 0.5 * (panels.end + panels.start), 0.5 * (panels.end - panels.start)
    return np.column_stack((start + middle * tangent, half * tangent))


@lru_cache(maxsize=4096)
def _corner_block(angle: float, nodes: int, closeness: float) -> FloatArray:
    """R of one corner on its incoming and outgoing leg together."""
    even, odd = corner_operator(angle, nodes, closeness).compressed
    same, other = 0.5 * (even + odd), 0.5 * (even - odd)
    return np.block([[same, other], [other, same]])


@cache
def _threads() -> ThreadpoolController:
    return ThreadpoolController()
