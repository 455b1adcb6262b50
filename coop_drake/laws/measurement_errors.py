"""Errors of what a sensor measures once in every control period: normal noise and square waves."""

from __future__ import annotations

from math import floor

from coop_drake.jit import compiled
from coop_drake.laws.random_draws import write_normals
from coop_drake.tree.pose import FloatArray


@compiled
def square_wave(number: int, size: float, length: float, phase: float) -> float:
    """Return ``size`` in the first half of every wave and ``-size`` in the second.

    Args:
        number: Number of the control period.
        size: Magnitude.
        length: Control periods of a wave, positive.
        phase: How much of a wave has passed at number 0, in waves [-].
    """
    passed = number / length + phase
    return size if passed - floor(passed) < 0.5 else -size


@compiled(borrows=True)
def write_errors(
    seed: int, deviations: FloatArray, waves: FloatArray, number: int, errors: FloatArray
) -> None:
    """Write the errors of all components of a measurement in one control period.

    Args:
        seed: Seed of the noise, from 0 to 2^32 - 1.
        deviations: Standard deviations of the noise, shape (n,).
        waves: Size, length in control periods and phase of every component's wave, shape (n, 3).
        number: Number of the period.
        errors: Receives the errors, shape (n,).
    """
    write_normals(seed, number, errors)
    for i in range(errors.size):
        errors[i] *= deviations[i]
        if waves[i, 0] != 0.0:
            errors[i] += square_wave(number, waves[i, 0], waves[i, 1], waves[i, 2])


@compiled(borrows=True)
def shift_back(values: FloatArray, before: FloatArray, share: float) -> None:
    """Replace what is measured by what it was a part of a period earlier, or will be later.

    Between two samples, and as much beyond, motions are taken for uniform, so that nothing is shifted by more
    than the shift times the largest rate in this period.

    Args:
        values: What there is to measure at a sample, shape (n,).
        before: What there was at the one before, shape (n,).
        share: How much earlier, in periods; may be negative [-].
    """
    for i in range(values.size):
        values[i] -= share * (values[i] - before[i])
