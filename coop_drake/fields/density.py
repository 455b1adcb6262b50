"""The boundary integral equation of one map: assembled, factorised once, its density refined.

With the complex density mu and the domain on the left of every ring,

    T(z) = Re (1 / 2 pi i) oint mu dt / (t - z),  real and imaginary part of mu apart,

is harmonic, single-valued, and has no flux round any hole. On the boundary

    mu + 2 K mu - 2 c_k [on hole k] = 2 g,    oint over hole k of mu |dt| = 0,

K the double layer, g = exp(i angle) on the outer ring and 0 on holes; hole k collapses to the point c_k.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from math import pi

import numpy as np
import scipy.linalg
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

from coop_drake.fields.compiled import compiled
from coop_drake.fields.corners import corner_operator
from coop_drake.fields.nodes import Nodes, place_nodes
from coop_drake.fields.outline import ComplexArray, Outline
from coop_drake.fields.panels import Panels
from coop_drake.fields.quadrature import FloatArray, legendre_transform

__all__ = ["REFINED_NODES", "Density", "solve_density"]

_NEAR = 4.3  # |zeta - 1| + |zeta + 1| below which panels are integrated exactly
REFINED_NODES = 16  # nodes on a panel after the Nystrom interpolation
_LARGE = 1_000  # unknowns from which single precision pays
_REFINEMENTS = 10
_CONVERGED = 1e-12  # residual per unit of the solution that counts as double precision


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
    first, transform = int(grid.corner_start[-1]), legendre_transform(nodes)
    segments = _segments(outline, panels)
    _fill_double_layer(grid.position, grid.element, grid.edge, grid.corner, matrix)
    _fill_near(grid.position, grid.edge, segments, panels.edge, transform, first, matrix)
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
        refined.position, refined.edge, refined.corner, segments, transform, first, incoming,
    )  # fmt: skip
    return Density(grid, weighted, refined, incoming, images, condition)


def _segments(outline: Outline, panels: Panels) -> ComplexArray:
    """Centre and half vector of each regular panel, shape (panels, 2)."""
    start = outline.vertices[panels.edge]
    tangent = (outline.ends - outline.vertices)[panels.edge]
    tangent = tangent / np.abs(tangent)
    middle, half = 0.5 * (panels.end + panels.start), 0.5 * (panels.end - panels.start)
    return np.column_stack((start + middle * tangent, half * tangent))


def _as_real(z: ComplexArray) -> FloatArray:
    return np.column_stack((z.real, z.imag))


@lru_cache(maxsize=4096)
def _corner_block(angle: float, nodes: int, closeness: float) -> FloatArray:
    """R of one corner on its incoming and outgoing leg together."""
    even, odd = corner_operator(angle, nodes, closeness).compressed
    same, other = 0.5 * (even + odd), 0.5 * (even - odd)
    return np.block([[same, other], [other, same]])


@cache
def _threads() -> ThreadpoolController:
    return ThreadpoolController()


def _factorise_and_solve(matrix: FloatArray, right: FloatArray) -> tuple[FloatArray, float]:
    """Solve on one thread: on few cores a threaded factorisation of this size is slower.

    Large systems are factorised in single precision, in less than half the time, and refined with residuals
    in double; the equation is of the second kind, so that takes three or four steps.
    """
    norm = _one_norm(matrix)
    with _threads().limit(limits=1, user_api="blas"):
        if len(matrix) >= _LARGE:
            single = scipy.linalg.lu_factor(
                matrix.astype(np.float32, order="F"), overwrite_a=True, check_finite=False
            )
            solution = _refined(matrix, right, single)
            if solution is not None:
                reciprocal, _ = scipy.linalg.lapack.sgecon(single[0], norm)
                return solution, 1.0 / max(float(reciprocal), 1e-300)
        factors = scipy.linalg.lu_factor(matrix, overwrite_a=True, check_finite=False)
        solution = scipy.linalg.lu_solve(factors, right, check_finite=False)
        reciprocal, _ = scipy.linalg.lapack.dgecon(factors[0], norm)
    return solution, 1.0 / max(float(reciprocal), 1e-300)


def _refined(
    matrix: FloatArray, right: FloatArray, single: tuple[np.ndarray, np.ndarray]
) -> FloatArray | None:
    """Refine a solution in single precision to double; None if that does not converge."""
    solution, residual = np.zeros_like(right), right
    before = np.inf
    for _ in range(_REFINEMENTS):
        step = scipy.linalg.lu_solve(single, residual.astype(np.float32), check_finite=False)
        solution = solution + step
        residual = right - matrix @ solution
        left = float(np.abs(residual).max())
        if left > 0.5 * before:  # as far as rounding lets it fall
            return solution if left <= _CONVERGED * float(np.abs(solution).max()) else None
        before = left
    return None


@compiled
def _one_norm(matrix: FloatArray) -> float:
    """Largest column sum of magnitudes."""
    largest = 0.0
    for j in range(matrix.shape[1]):
        total = 0.0
        for i in range(matrix.shape[0]):
            total += abs(matrix[i, j])
        largest = max(largest, total)
    return largest


@compiled
def _fill_double_layer(
    position: ComplexArray, element: ComplexArray, edge: np.ndarray, corner: np.ndarray, matrix: FloatArray
) -> None:
    """2 K between all nodes but those of one edge (exactly zero) and of one corner (compressed apart)."""
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
def _fill_near(
    target: ComplexArray, target_edge: np.ndarray, segments: ComplexArray, edge: np.ndarray,
    transform: FloatArray, first: int, matrix: FloatArray,
) -> None:  # fmt: skip
    """Overwrite the columns of regular panels where a target is near: exact for polynomial densities."""
    p = len(transform)
    moments = np.empty(p)
    for k in range(len(segments)):
        centre, half = segments[k, 0], segments[k, 1]
        for i in range(len(target)):
            if target_edge[i] == edge[k]:
                continue
            zeta = (target[i] - centre) / half
            if abs(zeta - 1.0) + abs(zeta + 1.0) < _NEAR:
                _legendre_moments(zeta, moments)
                for j in range(p):
                    weight = 0.0
                    for degree in range(p):
                        weight += moments[degree] * transform[degree, j]
                    matrix[i, first + k * p + j] = weight


@compiled
def _legendre_moments(zeta: complex, out: FloatArray) -> None:
    """1/pi times the imaginary part of the integral of P_k(x) / (x - zeta) over [-1, 1], k from 0."""
    q0 = 0.5 * (np.log(zeta + 1.0) - np.log(zeta - 1.0))
    q1 = zeta * q0 - 1.0
    out[0], out[1] = -2.0 / pi * q0.imag, -2.0 / pi * q1.imag
    for k in range(1, len(out) - 1):
        q0, q1 = q1, ((2 * k + 1) * zeta * q1 - k * q0) / (k + 1)
        out[k + 1] = -2.0 / pi * q1.imag


@compiled
def _subtract_double_layer(
    position: ComplexArray, element: ComplexArray, edge: np.ndarray, corner: np.ndarray, density: FloatArray,
    target: ComplexArray, target_edge: np.ndarray, target_corner: np.ndarray,
    segments: ComplexArray, transform: FloatArray, first: int, out: FloatArray,
) -> None:  # fmt: skip
    """Subtract 2 K density at other points of the boundary, by the same rules."""
    x, y = position.real.copy(), position.imag.copy()
    dx, dy = element.real / pi, element.imag / pi
    p = len(transform)
    moments = np.empty(p)
    for i in range(len(target)):
        px, py, e, c = target[i].real, target[i].imag, target_edge[i], target_corner[i]
        su, sv = 0.0, 0.0
        for j in range(first):
            rx, ry = x[j] - px, y[j] - py
            value = (dy[j] * rx - dx[j] * ry) / (rx * rx + ry * ry)
            value = 0.0 if edge[j] == e or (corner[j] == c and c >= 0) else value
            su += value * density[j, 0]
            sv += value * density[j, 1]
        for k in range(len(segments)):
            start = first + k * p
            if edge[start] == e:
                continue
            zeta = (target[i] - segments[k, 0]) / segments[k, 1]
            if abs(zeta - 1.0) + abs(zeta + 1.0) < _NEAR:
                _legendre_moments(zeta, moments)
                for degree in range(p):
                    for j in range(p):
                        weight = moments[degree] * transform[degree, j]
                        su += weight * density[start + j, 0]
                        sv += weight * density[start + j, 1]
            else:
                for j in range(start, start + p):
                    rx, ry = x[j] - px, y[j] - py
                    value = (dy[j] * rx - dx[j] * ry) / (rx * rx + ry * ry)
                    su += value * density[j, 0]
                    sv += value * density[j, 1]
        out[i, 0] -= su
        out[i, 1] -= sv
