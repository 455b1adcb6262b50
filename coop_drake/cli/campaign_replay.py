"""Makes one run of a campaign again, as `run` makes one, and compares it with what was counted."""

from __future__ import annotations

from dataclasses import fields
from math import isnan, nan
from typing import TYPE_CHECKING, Any

from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.run import carry_out, simulation_of
from coop_drake.cli.task import Task
from coop_drake.errors import ProcessError, ScenarioError
from coop_drake.viz.drawing_processes import DrawingProcesses

if TYPE_CHECKING:
    from coop_drake.campaign import Campaign, RunRecord
    from coop_drake.campaign.batches import Batch
    from coop_drake.campaign.results import CampaignFolder
    from coop_drake.campaign.settings import Tier
    from coop_drake.diagram import Blocks

_LOOPS = {"drake": "Drake's loop", "compiled": "the compiled loop"}

_NAMES = "run", "scenario", "tier", "seed", "values", "digest", "blocks"
"""Columns of a record that say which run it is, not what it left."""


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

    A run of the compiled tier is made again by the compiled loop, too.

    Raises:
        ScenarioError: There is no such run, or the file has no section of runs.
        ProcessError: The run differs from the one that was counted.
    """
    from coop_drake.answers.log import SimulationLog
    from coop_drake.answers.plan_file import plan_digest
    from coop_drake.campaign.measuring import record_of_log
    from coop_drake.campaign.plans import Plans
    from coop_drake.campaign.running.making import RunMaker, run_digest
    from coop_drake.campaign.variation import Variation
    from coop_drake.plant import planning_problem

    if campaign.runs is None:
        raise ScenarioError(
            str(campaign.path), "runs", None, "a section of runs: none is replayed without it"
        )
    variation = Variation(campaign)
    run = variation.run(index)
    scenario = variation.scenario_of(run)
    plans = Plans(variation, folder.plans)
    plan = plans.plan_of(run)
    reporter.note(scenario.workspace.notes)
    task = Task(scenario, planning_problem(scenario))
    results = ResultFolder.of(task.name, folder.path / "replays" / str(index), "simulation")
    counted = _counted(index, "drake", folder, batches)
    blocks: Blocks = "fused" if counted and counted["blocks"] == "fused" else "named"
    simulation = simulation_of(task, blocks, reporter)
    with DrawingProcesses(figures=figures) as drawing:
        code = carry_out(task, plan, results, reporter, drawing, None, simulation, fresh_maps=False)
    log = SimulationLog.load(results.path / "log.npz")
    digest = run_digest(scenario, plan_digest(plan), "drake")
    drake = record_of_log(run, scenario.name, log, plan, digest, blocks)
    reporter.facts.update(run=index, counted=False)
    _compare(drake, counted, reporter)
    if any(one.tier == "compiled" and one.first <= index < one.stop for one in batches):
        compiled = RunMaker(variation, plans, "compiled", folder.path / "logs").record(run)
        _show_both(drake, compiled, reporter)
        _compare(compiled, _counted(index, "compiled", folder, batches), reporter)
    return code


def _counted(
    index: int, tier: Tier, folder: CampaignFolder, batches: tuple[Batch, ...]
) -> dict[str, Any] | None:
    """Return the record of a run in a tier, None if it was not counted."""
    mine = [one for one in batches if one.tier == tier and one.first <= index < one.stop]
    return next((row for row in folder.table(mine).to_pylist() if row["run"] == index), None)


def _compare(again: RunRecord, counted: dict[str, Any] | None, reporter: Reporter) -> None:
    loop = _LOOPS[again.tier]
    if not counted:
        reporter.say(f"Run {again.run} was not counted by {loop}; values and seed are those of any tier")
        return
    reporter.facts["counted"] = True
    differing = [name for name, value in counted.items() if not _same(value, getattr(again, name))]
    if differing:
        what = ", ".join(differing)
        raise ProcessError(f"run {again.run} of {loop} differs from the one that was counted in {what}")
    reporter.say(f"Run {again.run} of {loop} is the one that was counted, to the last bit")


def _show_both(drake: RunRecord, compiled: RunRecord, reporter: Reporter) -> None:
    """Show what a run left in both loops, and the differences of its numbers."""
    rows, facts = [], {}
    for name in (one.name for one in fields(drake) if one.name not in _NAMES):
        first, second = getattr(drake, name), getattr(compiled, name)
        facts[name] = [None if _same(value, nan) else value for value in (first, second)]
        numbers = isinstance(first, float) and isinstance(second, float)
        texts = [f"{value:.9g}" if isinstance(value, float) else str(value) for value in (first, second)]
        rows.append((name, *texts, f"{second - first:.2g}" if numbers else ""))
    reporter.facts["tiers"] = facts
    headings = "Drake's loop", "the compiled loop", "difference"
    reporter.table(f"Run {drake.run}", rows, headings, "column")


def _same(first: Any, second: Any) -> bool:
    both = isinstance(first, float) and isinstance(second, float)
    return first == second or (both and isnan(first) and isnan(second))
