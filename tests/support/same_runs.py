"""Whether two runs are the same, bit for bit."""

from dataclasses import fields

import numpy as np

from coop_drake.answers.log import SimulationLog


def differences(first: SimulationLog, second: SimulationLog) -> list[str]:
    """Names of the fields in which two logs differ."""
    pairs = [(field.name, getattr(first, field.name), getattr(second, field.name)) for field in fields(first)]
    return [name for name, a, b in pairs if not (np.array_equal(a, b) if hasattr(a, "shape") else a == b)]
