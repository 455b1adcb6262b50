"""From what the values of a varied key are drawn: the distributions of Drake's schema, by the same names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from coop_drake.typed_data import TAGGED, DataError, Limits, NotNegative, Real

_BETWEEN = 0.3819660112501051
"""Where in an interval a number is tried for a key [-]: at no simple fraction of it."""


@dataclass(frozen=True)
class Deterministic:
    """Always the same number.

    Attributes:
        value: The number, in the unit of the key.
    """

    value: Real

    def draw(self, generator: np.random.Generator) -> float:
        """Return the number."""
        return self.value

    def extremes(self) -> tuple[float, ...]:
        """Return the number."""
        return (self.value,)


@dataclass(frozen=True)
class Uniform:
    """Any number between two, each as likely.

    Attributes:
        min: Smallest number, in the unit of the key.
        max: Largest number; it is itself never drawn unless it is the smallest, too.
    """

    min: Real
    max: Real

    def __post_init__(self) -> None:
        if self.max < self.min:
            raise DataError("max", self.max, f"a number of at least min, {self.min:g}")

    def draw(self, generator: np.random.Generator) -> float:
        """Draw a number."""
        return float(generator.uniform(self.min, self.max))

    def extremes(self) -> tuple[float, ...]:
        """Return the ends of the interval, and a number between that is not whole."""
        return self.min, self.max, self.min + _BETWEEN * (self.max - self.min)


@dataclass(frozen=True)
class Gaussian:
    """A normal distribution. What the key does not allow is drawn again, so that its limits cut it off.

    Attributes:
        mean: Mean, in the unit of the key.
        stddev: Standard deviation.
    """

    mean: Real
    stddev: NotNegative

    def draw(self, generator: np.random.Generator) -> float:
        """Draw a number."""
        return float(generator.normal(self.mean, self.stddev))

    def extremes(self) -> tuple[float, ...]:
        """Return the mean: there are no ends."""
        return (self.mean,)


@dataclass(frozen=True)
class UniformDiscrete:
    """One of some numbers, each as likely.

    Attributes:
        values: The numbers, in the unit of the key.
    """

    values: tuple[Real, ...]

    def __post_init__(self) -> None:
        if not self.values:
            raise DataError("values", [], "a list of at least one number")

    def draw(self, generator: np.random.Generator) -> float:
        """Draw one of the numbers."""
        return self.values[int(generator.integers(len(self.values)))]

    def extremes(self) -> tuple[float, ...]:
        """Return all numbers."""
        return self.values


Distribution = Annotated[Deterministic | Uniform | Gaussian | UniformDiscrete, TAGGED]
"""What a varied key is drawn from, by its tag."""

Count = Annotated[int, Limits(at_least=1)]
"""A number of things of which there is at least one."""
