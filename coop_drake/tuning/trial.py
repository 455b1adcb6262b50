"""One trial: the plan's cells with other gains through the closed loop, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from coop_drake.answers import Found, Plan, PlanningProblem
from coop_drake.diagram import Blocks, build_closed_loop
from coop_drake.errors import ScenarioError
from coop_drake.fields import HarmonicMap
from coop_drake.laws import GainSet
from coop_drake.planning import reschedule
from coop_drake.planning.planner import plan
from coop_drake.scenario import Scenario
from coop_drake.simulation import SimulationLog, build_maps, simulate
from coop_drake.tuning.criteria import CRITERIA

__all__ = ["Outcome", "Trial", "Workbench", "outcome_of", "quickest_blocks"]


@dataclass(frozen=True)
class Outcome:
    """What a run came to.

    Attributes:
        arrived: Whether the object came to rest at the goal and nothing was violated.
        share_done: Share of the cells that were passed [-].
        values: Every criterion by name.
        violation: What was violated; empty if nothing was.
    """

    arrived: bool
    share_done: float
    values: Mapping[str, float]
    violation: str


@dataclass(frozen=True)
class Trial:
    """A gain set that was tried.

    Attributes:
        gains: The gain set.
        outcome: What came of it.
    """

    gains: GainSet
    outcome: Outcome


def quickest_blocks(scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap]) -> Blocks:
    """Fused blocks where they know all that the scenario wants, else named ones."""
    try:
        build_closed_loop(scenario, plan, maps, blocks="fused").release()
    except ScenarioError:
        return "named"
    return "fused"


class Workbench:
    """Tries gain sets on one plan: cells and maps stay, for neither depends on gains.

    Args:
        scenario: What is carried, by whom.
        plan: Its plan.
        maps: The harmonic map of every transition.
        longest: Runs that last longer count as failed [s].
        blocks: What drives the team: named blocks, or one fused block that is quicker.
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

    def try_gains(self, gains: GainSet) -> Trial:
        """Carry the plan out with other gains."""
        return Trial(gains, outcome_of(self.run(gains), len(self.plan.cells)))

    def planned_anew(self, problem: PlanningProblem, gains: GainSet) -> Outcome | None:
        """Plan with other gains, which may lead to other cells, and carry that out; None without a plan."""
        result = plan(problem, gains, gain_set_name="trial")
        if not isinstance(result, Found):
            return None
        maps = build_maps(result.plan, tolerance=self._scenario.maps.tolerance)
        return outcome_of(simulate(self._scenario, result.plan, maps), len(result.plan.cells))

    def run(self, gains: GainSet) -> SimulationLog:
        """The same, with all that happened."""
        made = reschedule(self.plan, gains, "trial")
        return simulate(self._scenario, made, self.maps, blocks=self._blocks)


def outcome_of(log: SimulationLog, cells: int) -> Outcome:
    """Judge a run by every criterion.

    Args:
        log: The run.
        cells: How many cells the plan has.
    """
    arrived = log.reached and not log.violation
    done = 1.0 if arrived else float(log.cell_index[-1]) / cells
    values = {name: criterion.measure(log) for name, criterion in CRITERIA.items()}
    return Outcome(arrived, done, values, log.violation)
