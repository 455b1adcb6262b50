"""Criteria by which runs are compared: time, effort, smoothness and margins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coop_drake.answers.log import SimulationLog


@dataclass(frozen=True)
class Criterion:
    """One number by which runs are compared.

    Attributes:
        name: Name on the command line and in files.
        label: Name in tables and figures.
        unit: Unit of the number.
        measure: Computes the number from the log of a run.
        more_is_better: Whether larger numbers are better, as for margins.
    """

    name: str
    label: str
    unit: str
    measure: Callable[[SimulationLog], float]
    more_is_better: bool = False


def _base_forces(log: SimulationLog) -> np.ndarray:
    """Return the force of every base at every accepted step, shape (T, N) [N]."""
    return np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1])


def _mean_force(log: SimulationLog) -> float:
    """Return the root mean square force over time and bases; steps differ in length and are weighted [N]."""
    squares = (_base_forces(log) ** 2).mean(axis=1)
    return float(np.sqrt(np.trapezoid(squares, log.times) / log.times[-1]))


def _turning(log: SimulationLog) -> float:
    """Return the largest mean angular acceleration of the object over an accepted step [rad/s^2]."""
    steps = np.diff(log.times)
    moved = steps > 0.0
    return float(np.abs(np.diff(log.object_twist[:, 2])[moved] / steps[moved]).max(initial=0.0))


CRITERIA = {
    criterion.name: criterion
    for criterion in (
        Criterion("time", "duration", "s", lambda log: float(log.times[-1])),
        Criterion("peak_force", "peak base force", "N", lambda log: float(_base_forces(log).max())),
        Criterion("force_rate", "peak rate of base forces", "N/s", lambda log: log.peak_force_rate),
        Criterion("mean_force", "root mean square base force", "N", _mean_force),
        Criterion(
            "peak_base_torque",
            "peak base torque",
            "N m",
            lambda log: float(np.abs(log.base_wrenches[..., 2]).max()),
        ),
        Criterion(
            "peak_torque",
            "peak joint torque",
            "N m",
            lambda log: float(np.abs(log.joint_torques).max(initial=0.0)),
        ),
        Criterion("peak_turning", "peak angular acceleration", "rad/s²", _turning),
        Criterion(
            "clearance",
            "clearance to walls and bodies",
            "m",
            lambda log: float(min(log.workspace_clearance.min(), log.body_clearance.min())),
            more_is_better=True,
        ),
        Criterion(
            "cell_margin",
            "margin to the cells' boundaries",
            "m",
            lambda log: float(log.cell_clearance.min()),
            more_is_better=True,
        ),
        Criterion(
            "funnel_margin",
            "margin to the funnel bounds",
            "rad",
            lambda log: float(log.funnel_margin.min()),
            more_is_better=True,
        ),
    )
}
"""All criteria by name."""
