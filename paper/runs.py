"""The reconstructed transport, planned once and carried out with every gain set."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from coop_drake.answers import Found, Plan, PlanningProblem
from coop_drake.answers.log import SimulationLog
from coop_drake.errors import PlanError
from coop_drake.harmonic_maps import MapStore
from coop_drake.planning import reschedule
from coop_drake.planning.planner import plan
from coop_drake.scenario import Scenario
from coop_drake.simulation import build_maps, simulate

__all__ = ["GAIN_SETS", "Run", "part_of", "reproduce_runs"]

Progress = Callable[[str, float], None]

GAIN_SETS = {"table_2": "the paper's gains (Table 2)", "scheduled": "scheduled gains"}
"""Gain sets that are compared, and their names in headings."""


@dataclass(frozen=True)
class Run:
    """The transport with one gain set.

    Attributes:
        gains: Name of the gain set.
        plan: The cells, with the gains of this set.
        log: What happened.
    """

    gains: str
    plan: Plan
    log: SimulationLog


def reproduce_runs(
    scenario: Scenario,
    problem: PlanningProblem,
    *,
    store: MapStore | None = None,
    progress: Progress | None = None,
) -> tuple[Run, ...]:
    """Plan the scenario and carry the same cells out with every one of ``GAIN_SETS``.

    Args:
        scenario: The reconstruction; it knows the gain sets.
        problem: What it asks.
        store: Where solved maps are kept; by default all are solved.
        progress: Told the stage and the fraction done, if given.

    Raises:
        PlanError: There is no plan.
    """
    name = scenario.selected_gains
    result = plan(problem, scenario.gain_sets[name], gain_set_name=name)
    if not isinstance(result, Found):
        raise PlanError(f"{scenario.path}: there is nothing to reproduce without a plan: {result.reason}")
    maps = build_maps(result.plan, tolerance=scenario.maps.tolerance, store=store)
    runs = []
    for number, gains in enumerate(GAIN_SETS):
        made = reschedule(result.plan, scenario.gain_sets[gains], gains)
        log = simulate(scenario, made, maps, progress=part_of(progress, number, len(GAIN_SETS)))
        runs.append(Run(gains, made, log))
    return tuple(runs)


def part_of(progress: Progress | None, number: int, count: int) -> Progress | None:
    """Return a progress callback for one of several simulations, which reports the progress of all."""
    if progress is None:
        return None

    def advance(doing: str, fraction: float) -> None:
        progress(doing, (number + fraction) / count)

    return advance
