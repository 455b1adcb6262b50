"""Departures that are a multiple of what a budget allows, each of them alone or all together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.searches.bounds import START, BoundedDepartures
from coop_drake.answers.budget import Budget
from coop_drake.tree import ComponentTree

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
