"""The boundary integral equation of one map: assembled, factorised once, its density refined.

With the complex density mu and the domain on the left of every ring, T(z) = Re (1 / 2 pi i) oint mu dt / (t - z),
real and imaginary part of mu apart, is harmonic, single-valued, and has no flux round any hole. On the boundary

    mu + 2 K mu - 2 c_k [on hole k] = 2 g,    oint over hole k of mu |dt| = 0,

K the double layer, g = exp(i angle) on the outer ring and 0 on holes; hole k collapses to the point c_k.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import pi

import numpy as np
import scipy.linalg
from threadpoolctl import ThreadpoolController

from coop_drake.fields.compiled import compiled
from coop_drake.fields.corners import corner_operator
from coop_drake.fields.nodes import Nodes, place_nodes
from coop_drake.fields.outline import ComplexArray, Outline
from coop_drake.fields.panels import Panels
from coop_drake.fields.quadrature import FloatArray

__all__ = ["REFINED_NODES", "Density", "solve_density"]

REFINED_NODES = 16  # nodes on a panel after the Nystrom interpolation


@dataclass(frozen=True)
class Density:
    """Solution of the integral equation.

    Attributes:
        nodes: Where the equation was solved.
        weighted: Density at the nodes, weight-corrected in corner blocks, shape (n, 2).
        refined: The discretisation with `REFINED_NODES` nodes a panel.
        incoming: On refined nodes: the density on regular panels, on corner blocks the field that comes
            in from the rest of the boundary, shape (m, 2).
        hole_images: c_k, shape (holes, 2).
        condition: Estimate of the matrix' condition in the 1-norm.
    """

    nodes: Nodes
    weighted: FloatArray
    refined: Nodes
    incoming: FloatArray
    hole_images: FloatArray
    condition: float


def solve_density(
    outline: Outline, panels: Panels, angles: FloatArray, nodes: int, closeness: float
) -> Density:
    """Solve for the density with ``nodes`` Gauss nodes a panel; arguments as in `place_nodes`."""
    grid = place_nodes(outline, panels, angles, nodes, closeness)
    n, holes = len(grid.position), outline.holes
    ring = outline.ring[grid.edge]
    matrix = np.zeros((n + holes, n + holes), order="F")
    _fill_double_layer(grid.position, grid.element, grid.edge, grid.corner, matrix)
    matrix[n + ring[ring > 0] - 1, np.flatnonzero(ring > 0)] = np.abs(grid.element[ring > 0])
    for k in range(holes):
        matrix[n + k, :n] /= matrix[n + k, :n].sum()
    blocks = [_corner_block(float(angle), nodes, closeness) for angle in angles]
    for start, block in zip(grid.corner_start, blocks, strict=False):
        columns = slice(start, start + len(block))
        matrix[:, columns] = matrix[:, columns] @ block
    matrix[np.arange(n), np.arange(n)] += 1.0
    matrix[np.flatnonzero(ring > 0), n + ring[ring > 0] - 1] = -2.0
    right = np.zeros((n + holes, 2))
    right[:n] = 2.0 * _as_real(grid.boundary_value)
    solution, condition = _factorise_and_solve(matrix, right)

    weighted = solution[:n].copy()
    for start, block in zip(grid.corner_start, blocks, strict=False):
        rows = slice(start, start + len(block))
        weighted[rows] = block @ weighted[rows]
    images = solution[n:]
    refined = place_nodes(outline, panels, angles, REFINED_NODES, closeness)
    constants = np.vstack((np.zeros((1, 2)), images))
    incoming = 2.0 * (_as_real(refined.boundary_value) + constants[outline.ring[refined.edge]])
    _subtract_double_layer(
        grid.position, grid.element, grid.edge, grid.corner, weighted,
        refined.position, refined.edge, refined.corner, incoming,
    )  # fmt: skip
    return Density(grid, weighted, refined, incoming, images, condition)


def _as_real(z: ComplexArray) -> FloatArray:
    return np.column_stack((z.real, z.imag))


def _corner_block(angle: float, nodes: int, closeness: float) -> FloatArray:
    """R of one corner on its incoming and outgoing leg together."""
    even, odd = corner_operator(angle, nodes, closeness).compressed
    same, other = 0.5 * (even + odd), 0.5 * (even - odd)
    return np.block([[same, other], [other, same]])


@cache
def _threads() -> ThreadpoolController:
    return ThreadpoolController()


def _factorise_and_solve(matrix: FloatArray, right: FloatArray) -> tuple[FloatArray, float]:
    """Solve in place on one thread: on few cores a threaded factorisation of this size is slower."""
    norm = float(np.abs(matrix).sum(axis=0).max())
    with _threads().limit(limits=1, user_api="blas"):
        factors = scipy.linalg.lu_factor(matrix, overwrite_a=True, check_finite=False)
        solution = scipy.linalg.lu_solve(factors, right, check_finite=False)
        reciprocal, _ = scipy.linalg.lapack.dgecon(factors[0], norm)
    return solution, 1.0 / max(float(reciprocal), 1e-300)


@compiled
def _fill_double_layer(
    position: ComplexArray, element: ComplexArray, edge: np.ndarray, corner: np.ndarray, matrix: FloatArray
) -> None:
    """2 K between all nodes but those of one edge (exactly zero) and those of one corner (compressed apart)."""
    n = len(position)
    x, y = position.real.copy(), position.imag.copy()
    for j in range(n):
        tx, ty, e, c = x[j], y[j], edge[j], corner[j]
        dx, dy = element[j].real / pi, element[j].imag / pi
        for i in range(n):
            rx, ry = tx - x[i], ty - y[i]
            value = (dy * rx - dx * ry) / (rx * rx + ry * ry)
            matrix[i, j] = 0.0 if edge[i] == e or (corner[i] == c and c >= 0) else value


@compiled
def _subtract_double_layer(
    position: ComplexArray, element: ComplexArray, edge: np.ndarray, corner: np.ndarray, density: FloatArray,
    target: ComplexArray, target_edge: np.ndarray, target_corner: np.ndarray, out: FloatArray,
) -> None:  # fmt: skip
    """Subtract 2 K density at other points of the boundary, with the same exceptions."""
    x, y = position.real.copy(), position.imag.copy()
    dx, dy = element.real / pi, element.imag / pi
    u, v = density[:, 0].copy(), density[:, 1].copy()
    for i in range(len(target)):
        px, py, e, c = target[i].real, target[i].imag, target_edge[i], target_corner[i]
        su, sv = 0.0, 0.0
        for j in range(len(x)):
            rx, ry = x[j] - px, y[j] - py
            value = (dy[j] * rx - dx[j] * ry) / (rx * rx + ry * ry)
            value = 0.0 if edge[j] == e or (corner[j] == c and c >= 0) else value
            su += value * u[j]
            sv += value * v[j]
        out[i, 0] -= su
        out[i, 1] -= sv
