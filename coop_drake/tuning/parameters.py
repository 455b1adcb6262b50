"""Gains as parameters of the search: fractions between 0 and 1 of a logarithmic range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, log
from typing import Any

import numpy as np

from coop_drake.errors import TuningError
from coop_drake.laws.gains import FixedGains, GainSet
from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class Parameter:
    """A gain that the search may change.

    Attributes:
        name: Field of the gain set.
        lower: Smallest value tried, positive, in the gain's unit.
        upper: Largest value tried, in the gain's unit.
    """

    name: str
    lower: float
    upper: float

    def value(self, fraction: float) -> float:
        """Return lower^(1 - f) upper^f for a fraction f, rounded to four digits; f is clipped to [0, 1]."""
        inside = min(max(fraction, 0.0), 1.0)
        return float(f"{exp(log(self.lower) + inside * log(self.upper / self.lower)):.4g}")

    def fraction(self, value: float) -> float:
        """Return the fraction f with lower^(1 - f) upper^f = value."""
        return log(value / self.lower) / log(self.upper / self.lower)


# The ranges hold an order of magnitude or two around the defaults. Ranges of a smallest and of a largest gain
# meet and do not overlap, so that every combination is a valid gain set.
_SCHEDULED = (
    Parameter("age_phase", 0.1, 0.8),
    Parameter("position_fraction", 0.1, 1.0),
    Parameter("ramp_fraction", 0.1, 1.0),
    Parameter("wall_stiffness", 2.0, 100.0),
    Parameter("min_stiffness", 10.0, 80.0),
    Parameter("max_stiffness", 80.0, 800.0),
    Parameter("damping_factor", 0.7, 3.0),
    Parameter("governor_factor", 0.3, 3.0),
    Parameter("funnel_acceleration", 2.0, 60.0),
    Parameter("goal_acceleration", 0.1, 4.0),
    Parameter("turning_acceleration", 0.1, 4.0),
    Parameter("min_decay_rate", 0.7, 4.0),
    Parameter("decay_fraction", 0.2, 1.0),
    Parameter("max_log_gain", 0.01, 1.0),
    Parameter("log_fraction", 0.05, 1.0),
    Parameter("log_acceleration", 1.0, 60.0),
    Parameter("energy_factor", 1.05, 3.0),
    Parameter("energy_allowance", 0.05, 3.0),
    Parameter("entry_rate", 0.005, 0.1),
)
_FIXED = (
    Parameter("stiffness", 10.0, 400.0),
    Parameter("damping", 2.0, 50.0),
    Parameter("governor_gain", 1.0, 30.0),
    Parameter("angle_decay_rate", 0.7, 8.0),
    Parameter("joint_decay_rate", 0.7, 8.0),
    Parameter("log_gain", 0.01, 3.0),
    Parameter("position_gain", 0.3, 4.0),
    Parameter("rate_gain", 0.5, 30.0),
    Parameter("energy_factor", 1.05, 3.0),
    Parameter("energy_allowance", 0.05, 3.0),
)


def tunable_parameters(gain_set: GainSet, names: Sequence[str] = ()) -> tuple[Parameter, ...]:
    """Return the parameters of a gain set, their ranges widened so that they contain its gains.

    ``names`` are those of the gains that may change; all by default.

    Raises:
        TuningError: A name is no gain of this set that can be changed.
    """
    tunable = _FIXED if isinstance(gain_set, FixedGains) else _SCHEDULED
    known = {parameter.name: parameter for parameter in tunable}
    for name in names:
        if name not in known:
            raise TuningError(f"--vary {name}: expected one of {', '.join(known)}")
    chosen = [known[name] for name in dict.fromkeys(names)] if names else list(known.values())
    values = [getattr(gain_set, parameter.name) for parameter in chosen]
    return tuple(
        replace(parameter, lower=min(parameter.lower, value), upper=max(parameter.upper, value))
        for parameter, value in zip(chosen, values, strict=True)
    )


def to_fractions(gain_set: GainSet, parameters: Sequence[Parameter]) -> FloatArray:
    """Return the parameters of a gain set as fractions of their ranges, shape (len(parameters),)."""
    return np.array([parameter.fraction(getattr(gain_set, parameter.name)) for parameter in parameters])


def with_fractions(gain_set: GainSet, parameters: Sequence[Parameter], fractions: FloatArray) -> GainSet:
    """Return the gain set with other values of its parameters.

    Raises:
        ValueError: The class of the gain set refuses the gains.
    """
    values: dict[str, Any] = {
        parameter.name: parameter.value(float(fraction))
        for parameter, fraction in zip(parameters, fractions, strict=True)
    }
    return replace(gain_set, **values)
