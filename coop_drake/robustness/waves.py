"""Functions of a team's joints as sums of waves, exact in values and slopes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import NamedTuple

import numpy as np

from coop_drake.tree import ComponentTree
from coop_drake.tree.arrays import FloatArray, IntArray

NOTHING = 1e-12
"""Waves that are smaller are left over by rounding [kg m^2 or less]."""

Wave = tuple[tuple[float, ...], tuple[int, ...], complex]
"""Turns and exponents of slides by all joints, and a complex size: size q^slides exp(i turns . q)."""


class Waves(NamedTuple):
    """Functions of n joints, each the sum of the waves that it owns.

    Attributes:
        turns: Turns by each joint, shape (waves, n) [-].
        slides: Exponents of each joint, shape (waves, n) [-].
        sizes: Sizes, shape (waves,).
        phases: Phases, shape (waves,) [rad].
        owners: The function that each belongs to, ascending, shape (waves,).
        functions: Number of functions.
    """

    turns: FloatArray
    slides: FloatArray
    sizes: FloatArray
    phases: FloatArray
    owners: IntArray
    functions: int

    def expanded(self, middles: FloatArray, reaches: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return values and slopes in the middles of boxes, and bounds of what is left within them.

        Args:
            middles: Shape (boxes, n).
            reaches: Half-widths, shape (boxes, n).

        Returns:
            Shape (boxes, functions), (boxes, functions, n) and (boxes, functions).
        """
        angle, turned = middles @ self.turns.T + self.phases, reaches @ np.abs(self.turns).T
        even, odd = self.sizes * np.cos(angle), -self.sizes * np.sin(angle)
        value, slope = even, odd[:, :, None] * self.turns
        rest = 0.5 * self.sizes * turned**2
        if self.slides.any():
            base, exponents = middles[:, None], self.slides[None]
            power = (base**exponents).prod(axis=2)
            by_joint = np.stack([_by_joint(base, exponents, j) for j in range(middles.shape[1])], axis=2)
            value, slope = power * even, power[:, :, None] * slope + even[:, :, None] * by_joint
            first = (np.abs(by_joint) * reaches[:, None]).sum(axis=2)
            far = ((np.abs(base) + reaches[:, None]) ** exponents).prod(axis=2)
            near = np.abs(power)
            rest = near * rest + self.sizes * (first * turned + far - near - first)
        return self._summed(value), self._summed(slope), self._summed(rest)

    def _summed(self, waves: FloatArray) -> FloatArray:
        owned = np.equal.outer(self.owners, np.arange(self.functions)).astype(float)
        return np.moveaxis(np.tensordot(waves, owned, (1, 0)), -1, 1)


def _by_joint(base: FloatArray, exponents: FloatArray, joint: int) -> FloatArray:
    """Return the slopes by one joint of the products of powers, shape (boxes, waves)."""
    lower = exponents.copy()
    lower[..., joint] = np.maximum(lower[..., joint] - 1, 0)
    slopes: FloatArray = exponents[..., joint] * (base**lower).prod(axis=2)
    return slopes


class Collector:
    """Sums up waves of numbered functions; waves of the same turns and slides become one."""

    def __init__(self) -> None:
        self._functions: list[dict[tuple[tuple[float, ...], tuple[int, ...]], complex]] = []

    def add(self, waves: Iterable[Wave]) -> int:
        """Add the function that is the real part of a sum of waves, and return its number."""
        own: dict[tuple[tuple[float, ...], tuple[int, ...]], complex] = {}
        for turns, slides, size in waves:
            if next((turn for turn in turns if turn), 0.0) < 0.0:
                turns, size = tuple(-turn for turn in turns), size.conjugate()
            own[turns, slides] = own.get((turns, slides), 0.0) + size
        self._functions.append(own)
        return len(self._functions) - 1

    def waves(self, joints: int) -> Waves:
        """Return all functions."""
        every = [
            (owner, turns, slides, size)
            for owner, own in enumerate(self._functions)
            for (turns, slides), size in own.items()
            if abs(size) > NOTHING
        ]
        owners = np.array([one[0] for one in every], dtype=np.intp)
        turns, slides = (np.array([one[i] for one in every], dtype=float).reshape(-1, joints) for i in (1, 2))
        sizes = np.array([one[3] for one in every], dtype=complex)
        return Waves(turns, slides, np.abs(sizes), np.angle(sizes), owners, len(self._functions))


def vector_product(first: Iterable[Wave], second: Sequence[Wave], factor: complex) -> Iterable[Wave]:
    """Yield factor * conj(first) * second: its real part is the scalar product, for -i the cross product."""
    for turns, slides, size in first:
        for other_turns, other_slides, other in second:
            yield (
                tuple(b - a for a, b in zip(turns, other_turns, strict=True)),
                tuple(a + b for a, b in zip(slides, other_slides, strict=True)),
                factor * size.conjugate() * other,
            )


def scaled(waves: Iterable[Wave], factor: complex) -> list[Wave]:
    """Return waves that are larger by a factor."""
    return [(turns, slides, factor * size) for turns, slides, size in waves]


@dataclass(frozen=True)
class TeamPoint:
    """A point of a component, seen from the object.

    Attributes:
        path: The axes that move it, theta first.
        steps: For every axis of the path the vector to the next axis; for the last one that to the point.
        tree: The team.
    """

    path: tuple[int, ...]
    steps: tuple[tuple[Wave, ...], ...]
    tree: ComponentTree

    @property
    def place(self) -> list[Wave]:
        """The point's position from the object's origin."""
        return list(chain.from_iterable(self.steps))

    @cached_property
    def slopes(self) -> dict[int, list[Wave]]:
        """J: the position's derivative by each axis of the path."""
        return {axis: self._slope(i) for i, axis in enumerate(self.path)}

    def _slope(self, i: int) -> list[Wave]:
        joint = self.tree.joints[self.path[i] - 1] if self.path[i] else None
        if joint is None or joint.kind == "revolute":
            sign = 1.0 if joint is None else joint.sign
            return scaled(chain.from_iterable(self.steps[i:]), 1j * sign)
        last = self.path[i] - 1  # the slide's own step, without its value
        return [
            (turns, tuple(e - (j == last) for j, e in enumerate(slides)), size)
            for turns, slides, size in self.steps[i]
            if slides[last]
        ]

    def bend(self, first: int, second: int) -> list[Wave]:
        """H: the position's second derivative by two axes."""
        if not {first, second} <= set(self.path):
            return []
        outer, inner = sorted((first, second), key=self.path.index)
        turn = self.spin(outer)
        return scaled(self.slopes[inner], 1j * turn) if turn else []

    def spin(self, axis: int) -> float:
        """By how much a unit of an axis turns the point's component [-]."""
        if axis not in self.path:
            return 0.0
        joint = self.tree.joints[axis - 1] if axis else None
        return 1.0 if joint is None else joint.sign if joint.kind == "revolute" else 0.0


def team_point(tree: ComponentTree, component: int, x: float, y: float) -> TeamPoint:
    """Return a point that is given in its component's frame [m]."""
    n, path, steps = len(tree.joints), [0], list[list[Wave]]([[]])
    turns, none, heading = [0.0] * n, (0,) * n, complex(1.0)
    for index in reversed(tree.ancestors[component]):
        joint = tree.components[index].joint
        if joint is None:
            continue
        at = joint.X_PJ
        steps[-1].append((tuple(turns), none, heading * complex(at.x, at.y)))
        heading *= complex(np.exp(1j * at.angle))
        path.append(1 + joint.index)
        steps.append([])
        if joint.kind == "revolute":
            turns[joint.index] += joint.sign
        else:
            own = tuple(int(j == joint.index) for j in range(n))
            steps[-1].append((tuple(turns), own, heading * complex(*joint.axis)))
    steps[-1].append((tuple(turns), none, heading * complex(x, y)))
    return TeamPoint(tuple(path), tuple(tuple(step) for step in steps), tree)
