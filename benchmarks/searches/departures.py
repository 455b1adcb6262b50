"""Departures within a budget, described by few numbers between 0 and 1, and multiples of what it allows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields, replace
from math import cos, hypot, pi, sin
from typing import Any

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.scenario.budget_file import wave_bounds
from coop_drake.scenario.deployment import Wave, Waves
from coop_drake.tree import ComponentTree
from coop_drake.tree.arrays import FloatArray

_SHORTEST, _LONGEST = 2.0, 4.0
"""Shortest period of a wave in control periods [-], so that its sign changes with every sample, and longest
one [s]: the errors that loops remember are those of the last second."""

_WAVES = ("position", "angle", "joints", "velocity", "turn_rate", "joint_rates")
"""Errors with a period and a phase of their own."""

_ANGLES = ("position", "velocity")
"""Errors with a direction."""

_SHARES = ("velocity", "turn_rate", "joint_rates")
"""Errors that together reach the budget's bounds of rates and of the velocity."""

START = "start of "
"""How names of numbers begin that say where the team stands at first."""

_DELAYS = ("delay", "lag", "report_age")
"""Departures up to the budget's bound."""

_LEAST_LAG = 0.2
"""Smallest lag over the budget's bound [-]: far shorter ones change nothing and take long to simulate."""


class BoundedDepartures:
    """Departures from the ideal team of which none is larger than a budget allows.

    Normal noise and losses are off, because no number bounds them. Errors of positions and angles are as
    large as they may be; those of rates share their bounds. Each is a square wave. The model's error, the
    delay, the lag and the age of reports are constant. The team stands off the plan's start by no more than
    the errors of positions and angles: as far as one that came to rest with a constant error.

    Args:
        budget: The budget.
        tree: The team, by which errors of rates become errors of the object's velocity.
    """

    def __init__(self, budget: Budget, tree: ComponentTree) -> None:
        self.budget, self._tree = budget, tree
        self.names = tuple(self._names())

    def _names(self) -> Iterator[str]:
        for wave in _WAVES:
            yield f"period of {wave}"
            yield f"phase of {wave}"
        yield from (f"direction of {name}" for name in _ANGLES)
        yield from (f"share of {name}" for name in _SHARES)
        yield "model_error"
        yield from _DELAYS
        if self.budget.joint_coulomb > 0.0 or self.budget.joint_viscous > 0.0:
            yield "joint_friction"
        yield from (f"{START}{axis}" for axis in ("x", "y", "theta"))
        yield from (f"{START}joint {i}" for i in range(len(self._tree.joints)))

    def values(self, fractions: FloatArray, factor: float = 1.0) -> dict[str, Any]:
        """Return keys of a scenario with their values.

        Args:
            fractions: A number between 0 and 1 for each of ``names``.
            factor: How many times the budget they may reach; 1 for departures inside it [-].
        """
        given = dict(zip(self.names, (float(fraction) for fraction in fractions), strict=True))
        budget = self.budget.scaled(factor)
        waves = self.waves(given, budget)
        values: dict[str, Any] = {
            f"deployment.measurements.waves.{name}.{key}": value
            for name, wave in asdict(waves).items()
            for key, value in wave.items()
        }
        noise = (f"deployment.measurements.{name}_noise" for name in ("position", "angle", "rate"))
        values |= dict.fromkeys((*noise, "deployment.messages.loss"), 0.0)
        values["deployment.mass_error"] = budget.model_error * (2.0 * given["model_error"] - 1.0)
        values["deployment.measurements.delay"] = budget.delay * given["delay"]
        values["deployment.actuators.lag"] = budget.lag * (_LEAST_LAG + (1.0 - _LEAST_LAG) * given["lag"])
        values["deployment.messages.delay"] = budget.report_age * given["report_age"]
        if "joint_friction" in given:
            for name, size in (("coulomb", budget.joint_coulomb), ("viscous", budget.joint_viscous)):
                values[f"deployment.joint_friction.{name}"] = size * given["joint_friction"]
        return values | self._start(given, budget)

    def _start(self, given: Mapping[str, float], budget: Budget) -> dict[str, Any]:
        x, y, *axes = (2.0 * value - 1.0 for name, value in given.items() if name.startswith(START))
        place = budget.position_noise / max(1.0, hypot(x, y))
        away = [budget.angle_noise * axis for axis in axes]
        offset = {"x": place * x, "y": place * y, "theta": away[0], "joints": away[1:]}
        return {f"deployment.start_offset.{key}": value for key, value in offset.items()}

    def waves(self, given: Mapping[str, float], budget: Budget) -> Waves:
        """Return errors of measurements that reach a budget's bounds and do not exceed them."""
        shape = {name: self._shape(given[f"period of {name}"], given[f"phase of {name}"]) for name in _WAVES}
        sizes = {name: given[f"share of {name}"] for name in _SHARES}
        plane = {name: 2.0 * pi * given[f"direction of {name}"] for name in _ANGLES}

        def directed(name: str, size: float) -> tuple[Wave, Wave]:
            along = size * cos(plane[name]), size * sin(plane[name])
            return _signed(shape[name], along[0]), _signed(shape[name], along[1])

        x, y = directed("position", budget.position_noise)
        velocity_x, velocity_y = directed("velocity", sizes["velocity"] * budget.velocity_noise)
        waves = Waves(
            x,
            y,
            _signed(shape["angle"], budget.angle_noise),
            _signed(shape["joints"], budget.angle_noise),
            velocity_x,
            velocity_y,
            _signed(shape["turn_rate"], sizes["turn_rate"] * budget.rate_noise),
            _signed(shape["joint_rates"], sizes["joint_rates"] * budget.rate_noise),
        )
        reached = wave_bounds(waves, self._tree)
        over = max(
            1.0,
            reached.rate / budget.rate_noise if reached.rate > 0.0 else 0.0,
            reached.velocity / budget.velocity_noise if reached.velocity > 0.0 else 0.0,
        )
        smaller = {
            name: replace(getattr(waves, name), size=getattr(waves, name).size / over)
            for name in (one.name for one in fields(Waves))
            if name.startswith("velocity") or name.endswith("rate") or name.endswith("rates")
        }
        return replace(waves, **smaller)

    def _shape(self, period: float, phase: float) -> Wave:
        shortest = _SHORTEST * self.budget.period
        return Wave(0.0, float(shortest * (_LONGEST / shortest) ** period), phase)

    @property
    def middle(self) -> FloatArray:
        """Numbers in the middle of their ranges, shape (len(names),)."""
        return np.full(len(self.names), 0.5)


def _signed(shape: Wave, size: float) -> Wave:
    """Return a wave of a size that may be negative: half a period earlier it is its opposite."""
    return replace(shape, size=abs(size), phase=(shape.phase + (0.5 if size < 0.0 else 0.0)) % 1.0)


_SIZES = ("angle_noise", "rate_noise", "velocity_noise", "position_noise", "model_error")
"""Errors that are switched off where another one acts alone."""

SCALED: Mapping[str, tuple[str, ...]] = {
    "delay": ("delay",),
    "lag": ("lag",),
    "angles": ("angle_noise",),
    "rates": ("rate_noise", "velocity_noise"),
    "position": ("position_noise",),
    "model": ("model_error",),
    "reports": ("report_age",),
    "all": _SIZES,
}
"""Bounds of a budget that each departure multiplies; the first one is stated in tables. Errors of rates make
those of the object's velocity, so that both are multiplied."""

_MOST = 0.9
"""Largest error of a model that can be simulated [-]: at one its masses would be zero."""


def multiplied(budget: Budget, departure: str, multiple: float) -> Budget:
    """Return a budget of which one departure is multiplied, see ``Breaking``."""
    scaled = {name: multiple * getattr(budget, name) for name in SCALED[departure]}
    if "model_error" in scaled:
        scaled["model_error"] = min(scaled["model_error"], _MOST)
    if departure not in ("delay", "lag", "reports", "all"):
        scaled = {**dict.fromkeys(_SIZES, 0.0), **scaled}
    sizes: dict[str, Any] = scaled
    return replace(budget, **sizes)


def largest_multiple(budget: Budget, departure: str, largest: float) -> float:
    """Return the largest multiple that is tried; that of the model's error leaves masses above zero."""
    if "model_error" not in SCALED[departure] or budget.model_error == 0.0:
        return largest
    return largest if departure == "all" else min(largest, _MOST / budget.model_error)


def departures_at(
    budget: Budget, tree: ComponentTree, departure: str, multiple: float, seed: int
) -> dict[str, Any]:
    """Return keys of a scenario with their values: departures at their bounds, with random periods and signs.

    Args:
        budget: What is certified.
        tree: The team.
        departure: Which departure is multiplied.
        multiple: By what [-].
        seed: Seed of periods, phases and directions.
    """
    bounded = BoundedDepartures(multiplied(budget, departure, multiple), tree)
    generator = np.random.default_rng(seed)
    drawn = dict(zip(bounded.names, generator.uniform(size=len(bounded.names)), strict=True))
    drawn["model_error"] = float(generator.integers(2))
    drawn |= {name: 0.5 for name in drawn if name.startswith(START)}  # Errors alone are multiplied.
    drawn |= {name: 1.0 for name in drawn if name in ("delay", "lag", "report_age") or "share" in name}
    return bounded.values(np.array([drawn[name] for name in bounded.names]))
