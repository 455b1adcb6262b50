"""Gains as numbers between 0 and 1 on a logarithmic scale, within bounds that keep a gain set valid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, log
from typing import Any

import numpy as np

from coop_drake.errors import TuningError
from coop_drake.laws.gains import FixedGains, FloatArray, GainSet

__all__ = ["Knob", "decoded", "encoded", "knobs_of"]


@dataclass(frozen=True)
class Knob:
    """A gain that may be turned.

    Attributes:
        name: Field of the gain set.
        lower: Smallest value tried.
        upper: Largest value tried.
    """

    name: str
    lower: float
    upper: float

    def value(self, share: float) -> float:
        """The gain at a share of the way from lower to upper, rounded to four digits."""
        inside = min(max(share, 0.0), 1.0)
        return float(f"{exp(log(self.lower) + inside * log(self.upper / self.lower)):.4g}")

    def share(self, value: float) -> float:
        """Where a value lies between lower and upper, 0 to 1."""
        return log(value / self.lower) / log(self.upper / self.lower)


_SCHEDULED = (
    Knob("wall_stiffness", 2.0, 100.0),
    Knob("min_stiffness", 10.0, 150.0),
    Knob("max_stiffness", 150.0, 1500.0),
    Knob("damping_factor", 0.4, 3.0),
    Knob("governor_factor", 0.2, 3.0),
    Knob("funnel_acceleration", 2.0, 60.0),
    Knob("min_decay_rate", 0.7, 4.0),
    Knob("max_decay_rate", 4.0, 16.0),
    Knob("max_log_gain", 0.01, 1.0),
    Knob("log_acceleration", 2.0, 60.0),
    Knob("position_gain", 0.3, 4.0),
    Knob("rate_gain", 2.0, 30.0),
    Knob("energy_factor", 1.05, 3.0),
    Knob("energy_allowance", 0.05, 3.0),
)
_FIXED = (
    Knob("stiffness", 10.0, 400.0),
    Knob("damping", 2.0, 50.0),
    Knob("governor_gain", 1.0, 30.0),
    Knob("angle_decay_rate", 0.7, 8.0),
    Knob("joint_decay_rate", 0.7, 8.0),
    Knob("log_gain", 0.01, 3.0),
    Knob("position_gain", 0.3, 4.0),
    Knob("rate_gain", 0.5, 30.0),
    Knob("energy_factor", 1.05, 3.0),
    Knob("energy_allowance", 0.05, 3.0),
)
# Bounds of a smallest and of a largest gain meet and never cross: all combinations are valid.


def knobs_of(gain_set: GainSet, names: Sequence[str] = ()) -> tuple[Knob, ...]:
    """The gains of a set that may be turned; bounds are widened to where the set is.

    Args:
        gain_set: Where the search begins.
        names: Gains to turn; all that can be by default.

    Raises:
        TuningError: A name is no gain of this set that can be turned.
    """
    known = {knob.name: knob for knob in (_FIXED if isinstance(gain_set, FixedGains) else _SCHEDULED)}
    for name in names:
        if name not in known:
            raise TuningError(f"--vary {name}: expected one of {', '.join(known)}")
    chosen = [known[name] for name in dict.fromkeys(names)] if names else list(known.values())
    return tuple(_reaching(knob, getattr(gain_set, knob.name)) for knob in chosen)


def _reaching(knob: Knob, value: float) -> Knob:
    return replace(knob, lower=min(knob.lower, value), upper=max(knob.upper, value))


def encoded(gain_set: GainSet, knobs: Sequence[Knob]) -> FloatArray:
    """Where a gain set lies between the bounds, shape (len(knobs),)."""
    return np.array([knob.share(getattr(gain_set, knob.name)) for knob in knobs])


def decoded(gain_set: GainSet, knobs: Sequence[Knob], shares: FloatArray) -> GainSet:
    """The gain set with its knobs turned.

    Raises:
        ValueError: The law refuses the gains.
    """
    turned: dict[str, Any] = {
        knob.name: knob.value(float(share)) for knob, share in zip(knobs, shares, strict=True)
    }
    return replace(gain_set, **turned)
