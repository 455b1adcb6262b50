"""The cells of Table 1 in closed loop with two gain sets: peaks, margins and durations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.log import SimulationLog
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import Scenario
from coop_drake.simulation import build_maps, simulate
from coop_drake.tuning import CRITERIA
from paper.corridor import corridor_plan, corridor_scenario
from paper.runs import GAIN_SETS, part_of

__all__ = ["GainFigures", "compare_gains"]


@dataclass(frozen=True)
class GainFigures:
    """The results of one gain set in the cells of Table 1.

    Attributes:
        name: The gain set.
        seconds: Duration of the transport [s].
        peak_force: Largest base force [N].
        peak_angular_acceleration: Of the object, between accepted steps [rad/s^2].
        peak_joint_rate: Largest rate of a joint [rad/s].
        funnel_margin: Smallest distance of an axis to its funnel [rad].
        energy_margin: Smallest Delta E [m^2/s^2].
        acceleration_error: Realised less commanded acceleration [m/s^2 or rad/s^2].
        wrench_error: Largest difference between a grasp's wrench in the plant and (31) [N or N m].
        governor_spread: Largest difference of p_G between the robots' copies [m].
        violation: What was violated; empty if nothing was.
    """

    name: str
    seconds: float
    peak_force: float
    peak_angular_acceleration: float
    peak_joint_rate: float
    funnel_margin: float
    energy_margin: float
    acceleration_error: float
    wrench_error: float
    governor_spread: float
    violation: str

    ROWS: ClassVar = (
        ("duration", "seconds", "{:.1f} s"),
        ("peak base force", "peak_force", "{:.0f} N"),
        ("peak angular acceleration", "peak_angular_acceleration", "{:.1f} rad/s²"),
        ("peak joint rate", "peak_joint_rate", "{:.2f} rad/s"),
        ("smallest funnel margin", "funnel_margin", "{:.4f} rad"),
        ("smallest energy margin", "energy_margin", "{:.1e} m²/s²"),
        ("largest acceleration error", "acceleration_error", "{:.1e} m/s²"),
        ("largest wrench error", "wrench_error", "{:.1e} N"),
        ("governors' largest difference", "governor_spread", "{:.1e} m"),
    )
    """Label, attribute and format of every figure, for tables."""


def compare_gains(
    scenario: Scenario,
    names: Sequence[str] = tuple(GAIN_SETS),
    progress: Callable[[str, float], None] | None = None,
) -> list[GainFigures]:
    """Simulate the thirty cells once with every gain set.

    Args:
        scenario: Of a team of two robots with a joint each, which knows the gain sets.
        names: The gain sets.
        progress: Told the stage and the fraction done, if given.
    """
    hall = corridor_scenario(scenario)
    problem = planning_problem(hall, build_team_plant(hall, DiagramBuilder()))
    plans = [corridor_plan(problem, hall.gain_sets[name], name) for name in names]
    maps = build_maps(plans[0])  # Gains change neither cells nor targets.
    figures = []
    for number, (name, found) in enumerate(zip(names, plans, strict=True)):
        log = simulate(hall, found, maps, progress=part_of(progress, number, len(names)))
        figures.append(_figures(name, log))
    return figures


def _figures(name: str, log: SimulationLog) -> GainFigures:
    return GainFigures(
        name=name,
        seconds=float(log.times[-1]),
        peak_force=CRITERIA["peak_force"].measure(log),
        peak_angular_acceleration=CRITERIA["peak_turning"].measure(log),
        peak_joint_rate=float(np.abs(log.joint_rates).max()),
        funnel_margin=float(log.funnel_margin.min()),
        energy_margin=float(log.energy_margin.min()),
        acceleration_error=float(log.acceleration_error.max()),
        wrench_error=float(log.wrench_error.max()),
        governor_spread=float(log.governor_spread.max()),
        violation=log.violation,
    )
