"""Makes one run of a campaign again, as `run` makes one, and compares it with what was counted."""

from __future__ import annotations

from math import isnan
from typing import TYPE_CHECKING, Any

from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.run import carry_out, simulation_of
from coop_drake.cli.task import Task
from coop_drake.errors import ProcessError
from coop_drake.viz.drawing_processes import DrawingProcesses

if TYPE_CHECKING:
    from coop_drake.campaign import Campaign, RunRecord
    from coop_drake.campaign.batches import Batch
    from coop_drake.campaign.results import CampaignFolder
    from coop_drake.diagram import Blocks


def replay(
    campaign: Campaign,
    folder: CampaignFolder,
    batches: tuple[Batch, ...],
    index: int,
    reporter: Reporter,
    *,
    figures: bool,
) -> ExitCode:
    """Make a run again by Drake's loop, with recording and figures, below the campaign's folder.

    Raises:
        ScenarioError: There is no such run.
        ProcessError: The run differs from the one that was counted.
    """
    from coop_drake.answers.log import SimulationLog
    from coop_drake.answers.plan_file import plan_digest
    from coop_drake.campaign.measuring import record_of_log
    from coop_drake.campaign.plans import Plans
    from coop_drake.campaign.running.making import run_digest
    from coop_drake.campaign.variation import Variation
    from coop_drake.plant import planning_problem

    assert campaign.runs is not None  # or there would be no batches
    variation = Variation(campaign)
    run = variation.run(index)
    scenario = variation.scenario_of(run)
    plan = Plans(variation, folder.plans).plan_of(run)
    task = Task(scenario, planning_problem(scenario))
    results = ResultFolder.of(task.name, folder.path / "replays" / str(index), "simulation")
    counted = _counted(index, folder, batches)
    blocks: Blocks = "fused" if counted and counted["blocks"] == "fused" else "named"
    simulation = simulation_of(task, blocks, reporter)
    with DrawingProcesses(figures=figures) as drawing:
        code = carry_out(task, plan, results, reporter, drawing, None, simulation, fresh_maps=False)
    log = SimulationLog.load(results.path / "log.npz")
    digest = run_digest(scenario, plan_digest(plan), "drake")
    _compare(record_of_log(run, scenario.name, log, plan, digest, blocks), counted, reporter)
    return code


def _counted(index: int, folder: CampaignFolder, batches: tuple[Batch, ...]) -> dict[str, Any] | None:
    """Return the record of a run of Drake's loop, None if it was not counted."""
    mine = [one for one in batches if one.tier == "drake" and one.first <= index < one.stop]
    return next((row for row in folder.table(mine).to_pylist() if row["run"] == index), None)


def _compare(again: RunRecord, counted: dict[str, Any] | None, reporter: Reporter) -> None:
    reporter.facts.update(run=again.run, counted=bool(counted))
    if not counted:
        reporter.say(f"Drake's loop has not counted run {again.run}; values and seed are those of any tier")
        return
    differing = [name for name, value in counted.items() if not _same(value, getattr(again, name))]
    if differing:
        raise ProcessError(f"run {again.run} differs from the one that was counted in {', '.join(differing)}")
    reporter.say(f"Run {again.run} is the one that was counted, to the last bit")


def _same(first: Any, second: Any) -> bool:
    both = isinstance(first, float) and isinstance(second, float)
    return first == second or (both and isnan(first) and isnan(second))
