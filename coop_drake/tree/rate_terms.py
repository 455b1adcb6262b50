"""Centripetal and Coriolis terms: how much the rates of a team's axes accelerate them by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.typed_data import Number

BODY = "component", "mass", "x", "y", "inertia"
"""What is stated of a body: index of its component in the team's tree, mass [kg], centre of mass in the
component's frame [m], and inertia about the vertical axis through it [kg m^2]."""

Bodies = tuple[tuple[Number, ...], ...]
"""The bodies of a team, each with the numbers of ``BODY``."""

Points = NDArray[np.complex128]
"""Points or directions in the plane in all configurations, x + i y, shape (configurations,)."""


class _Mover(NamedTuple):
    """An axis that moves a body.

    Attributes:
        axis: Its index among (theta, q...).
        sense: How it turns the body for each unit, 0 if it slides [-].
        place: Its pivot [m], or the direction in which it slides.
    """

    axis: int
    sense: float
    place: Points


def rate_terms(
    tree: ComponentTree, bodies: Bodies, rotors: Sequence[float], joints: FloatArray
) -> FloatArray:
    """Return how much pairs of rates accelerate the axes (theta, q...) where nothing is commanded.

    The acceleration of axis i is -(M^-1 C)_i, the sum over j and k <= j of a coefficient times w_j w_k. These
    coefficients do not depend on the object's pose.

    Args:
        tree: The team.
        bodies: All bodies.
        rotors: Inertia that its rotor adds to every joint, shape (n,), or empty for none [kg m^2 or kg].
        joints: Configurations of the joints, shape (configurations, n) [rad or m].

    Returns:
        Sizes of the coefficients, [..., i, j, k], zero for k > j, shape (configurations, axes, axes, axes).
    """
    count, axes = len(joints), 1 + joints.shape[1]
    mass = np.zeros((count, 2 + axes, 2 + axes))
    if len(rotors):
        mass[:, range(3, 2 + axes), range(3, 2 + axes)] = rotors
    pairs = list(combinations_with_replacement(range(axes), 2))
    force = np.zeros((count, 2 + axes, len(pairs)))
    movers, frames = _placed(tree, joints)
    for body in bodies:
        (origin, turned), own = frames[int(body[0])], movers[int(body[0])]
        _add_body((body[1], body[4]), origin + turned * complex(body[2], body[3]), own, pairs, mass, force)
    found, result = np.abs(np.linalg.solve(mass, force)[:, 2:]), np.zeros((count, axes, axes, axes))
    for column, (k, j) in enumerate(pairs):
        result[:, :, j, k] = found[:, :, column]
    return result


def _placed(
    tree: ComponentTree, joints: FloatArray
) -> tuple[list[list[_Mover]], list[tuple[Points, Points]]]:
    """Return what moves every component, from the object outwards, and its frame, the object's being at 0."""
    still = np.zeros(len(joints), dtype=np.complex128)
    movers, frames = [[_Mover(0, 1.0, still)]], [(still, still + 1.0)]
    for component in tree.components[1:]:
        joint, parent = component.joint, component.parent
        assert joint is not None
        assert parent is not None
        (origin, turned), value = frames[parent], joints[:, joint.index]
        origin = origin + turned * complex(joint.X_PJ.x, joint.X_PJ.y)
        turned = turned * np.exp(1j * joint.X_PJ.angle)
        slide = turned * complex(*joint.axis)
        if joint.kind == "revolute":
            own, turned = (
                _Mover(1 + joint.index, joint.sign, origin),
                turned * np.exp(1j * joint.sign * value),
            )
        else:
            own, origin = _Mover(1 + joint.index, 0.0, slide), origin + slide * value
        movers.append([*movers[parent], own])
        frames.append((origin, turned))
    return movers, frames


def _add_body(
    inertia: tuple[float, float],
    centre: Points,
    movers: Sequence[_Mover],
    pairs: Sequence[tuple[int, int]],
    mass: FloatArray,
    force: FloatArray,
) -> None:
    """Add one body to the mass matrices and to the forces that balance its acceleration at unit rates.

    ``inertia`` is its mass and its inertia about ``centre``, its centre of mass. A pair of axes moves it by
    the second derivative of this, twice for two different ones.
    """
    moved = np.zeros((len(centre), mass.shape[1]), dtype=np.complex128)
    moved[:, 0], moved[:, 1] = 1.0, 1j
    turns = np.zeros(mass.shape[1])
    second = np.zeros((len(centre), len(pairs)), dtype=np.complex128)
    for number, (axis, sense, place) in enumerate(movers):
        moved[:, 2 + axis] = 1j * sense * (centre - place) if sense else place
        turns[2 + axis] = sense
        for inner in movers[: number + 1]:  # whatever turns turns also how outer axes move the body
            column = pairs.index((min(inner.axis, axis), max(inner.axis, axis)))
            twice = 1.0 if inner.axis == axis else 2.0
            second[:, column] = twice * 1j * inner.sense * moved[:, 2 + axis]
    along = partial(np.einsum, "sd,se->sde", moved.conj())
    mass += inertia[0] * along(moved).real + inertia[1] * np.outer(turns, turns)
    force += inertia[0] * along(second).real
