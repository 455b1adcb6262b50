"""Centripetal and Coriolis terms by Lagrange's equations, from derivatives of the bodies' positions.

With M = sum m J^T J + I w^T w and unit rates of axes j and k, axis i is accelerated by -(M^-1 g)_i, where g
is the sum of m J^T times the second derivative of the body's position by j and k. First derivatives are taken
by an imaginary step, without rounding, and second ones as their differences.
"""

from __future__ import annotations

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Cell
from coop_drake.tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.runs.placement import points_in_world
from coop_drake.verification.solids import Stage, component_stages

TRIED = 40
"""Configurations that are drawn in every cell [-], other ones than the planner's."""

IMAGINARY, STEP = 1e-30, 1e-5
"""Imaginary step, and step of the difference of first derivatives [rad or m]."""


def couplings(budget: Budget, tree: ComponentTree, cells: tuple[Cell, ...]) -> FloatArray:
    """Return the largest coefficients found in every cell, [cell, i, j, k]; zero for k > j.

    They are zero in a budget without bodies.
    """
    axes = 1 + len(tree.joints)
    result = np.zeros((len(cells), axes, axes, axes))
    if not budget.bodies:
        return result
    shares = np.random.default_rng(5).beta(0.5, 0.5, (TRIED, axes - 1))  # more of them near the ends
    z = np.zeros((len(cells), TRIED, 2 + axes))
    for k, cell in enumerate(cells):
        z[k, :, 3:] = cell.lower[1:] + shares * (cell.upper[1:] - cell.lower[1:])
    found = _coefficients(budget, tree, z.reshape(-1, 2 + axes))
    largest: FloatArray = np.abs(found).reshape(len(cells), TRIED, axes, axes, axes).max(axis=1)
    return largest


def _coefficients(budget: Budget, tree: ComponentTree, z: FloatArray) -> FloatArray:
    size = z.shape[1]
    mass, forces = np.zeros((len(z), size, size)), np.zeros((len(z), size, size - 2, size - 2))
    rotors = range(3, 3 + len(budget.rotors))
    mass[:, rotors, rotors] = budget.rotors
    for component, m, x, y, inertia in budget.bodies:
        stages = component_stages(tree, int(component))
        point = np.array([[x, y]])
        moved = _derivatives(point, stages, z)
        spun = np.zeros(size)
        for stage in stages:
            spun[2 + stage.axis] = stage.scale if stage.kind == "revolute" else 0.0
        mass += m * np.einsum("cip,cjp->cij", moved, moved) + inertia * np.outer(spun, spun)
        for k in range(size - 2):
            away = STEP * np.eye(size)[2 + k]
            second = _derivatives(point, stages, z + away) - _derivatives(point, stages, z - away)
            forces[:, :, :, k] += m / (2.0 * STEP) * np.einsum("cip,cjp->cij", moved, second[:, 2:])
    solved = np.linalg.solve(mass, forces.reshape(len(z), size, -1)).reshape(forces.shape)[:, 2:]
    both: FloatArray = np.tril(solved) + np.tril(solved.swapaxes(2, 3), -1)
    return both


def _derivatives(point: FloatArray, stages: tuple[Stage, ...], z: FloatArray) -> FloatArray:
    """Return the derivatives of a body's position by all coordinates, shape (configurations, 3 + n, 2)."""
    size = z.shape[1]
    steps = [points_in_world(point, stages, z + 1j * IMAGINARY * np.eye(size)[j]) for j in range(size)]
    return np.stack([step[:, 0].imag for step in steps], axis=1) / IMAGINARY
