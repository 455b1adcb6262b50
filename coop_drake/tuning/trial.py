"""Trials of gain sets: a plan is simulated with other gains, and the run is measured by every criterion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from coop_drake.answers import Found, Plan, PlanningProblem
from coop_drake.answers.log import SimulationLog
from coop_drake.compiled_loop import build_fused_loop, simulate_fused
from coop_drake.diagram import Blocks
from coop_drake.errors import ScenarioError
from coop_drake.fields import HarmonicMap
from coop_drake.laws import GainSet
from coop_drake.planning import reschedule
from coop_drake.planning.planner import plan
from coop_drake.scenario import Scenario
from coop_drake.simulation import build_maps, simulate
from coop_drake.tuning.criteria import CRITERIA


@dataclass(frozen=True)
class RunOutcome:
    """Result of a simulated run.

    Attributes:
        arrived: Whether the object came to rest at the goal and no invariant was violated.
        fraction_done: Fraction of the plan's cells that were passed [-].
        values: Value of every criterion by name.
        violation: The invariant that was violated; empty if none was.
    """

    arrived: bool
    fraction_done: float
    values: Mapping[str, float]
    violation: str


@dataclass(frozen=True)
class GainTrial:
    """A gain set and the result of its run.

    Attributes:
        gains: The gain set.
        outcome: Result of the run.
    """

    gains: GainSet
    outcome: RunOutcome


def fastest_blocks(scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap]) -> Blocks:
    """Return ``fused`` if the fused block can do all that the scenario asks for, else ``named``."""
    try:
        build_fused_loop(scenario, plan, maps).release()
    except ScenarioError:
        return "named"
    return "fused"


class TrialRunner:
    """Simulates one plan with different gain sets; its cells and maps do not depend on gains.

    Args:
        scenario: The scenario.
        plan: Its plan.
        maps: The harmonic map of every transition.
        longest: Runs that last longer count as failed [s].
        blocks: Blocks of the controllers: named ones, or one fused block that is faster.
    """

    def __init__(
        self,
        scenario: Scenario,
        plan: Plan,
        maps: Sequence[HarmonicMap],
        *,
        longest: float | None = None,
        blocks: Blocks = "named",
    ) -> None:
        self.plan, self._blocks = plan, blocks
        self.maps = tuple(maps)
        settings = scenario.simulator
        if longest is not None:
            settings = replace(settings, max_time=min(longest, settings.max_time))
        self._scenario = replace(scenario, simulator=settings)

    def try_gains(self, gains: GainSet) -> GainTrial:
        """Simulate the plan with other gains, and measure the run."""
        return GainTrial(gains, outcome_of(self.run(gains), len(self.plan.cells)))

    def replan(self, problem: PlanningProblem, gains: GainSet) -> RunOutcome | None:
        """Plan again with other gains, which may give other cells, and simulate; None if no plan is found."""
        result = plan(problem, gains, gain_set_name="trial")
        if not isinstance(result, Found):
            return None
        maps = build_maps(result.plan, tolerance=self._scenario.maps.tolerance)
        return outcome_of(simulate(self._scenario, result.plan, maps), len(result.plan.cells))

    def run(self, gains: GainSet) -> SimulationLog:
        """Simulate the plan with other gains, and return the log of the run."""
        made = reschedule(self.plan, gains, "trial")
        run = simulate_fused if self._blocks == "fused" else simulate
        return run(self._scenario, made, self.maps)


def outcome_of(log: SimulationLog, cells: int) -> RunOutcome:
    """Measure a run of a plan with so many cells by every criterion."""
    arrived = log.reached and not log.violation
    done = 1.0 if arrived else float(log.cell_index[-1]) / cells
    values = {name: criterion.measure(log) for name, criterion in CRITERIA.items()}
    return RunOutcome(arrived, done, values, log.violation)
