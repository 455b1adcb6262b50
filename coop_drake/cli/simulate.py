"""The command simulate: carries out a plan that was made before."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import ApartOptions, ResultsFolder, RunOptions, ScenarioPath
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.run import carry_out, simulation_of
from coop_drake.cli.summary import plan_facts
from coop_drake.cli.task import Task, read_task
from coop_drake.errors import PlanError, RefusalError
from coop_drake.viz.drawing_processes import DrawingProcesses

if TYPE_CHECKING:
    from coop_drake.answers import Plan

EXAMPLES = (
    ("simulate models/base.scenario.yaml", "carry out out/base/plan.json"),
    ("simulate models/base.scenario.yaml --plan my_plan.json --gains table_2", "another plan, other gains"),
)


def simulate_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    plan: Annotated[
        Path | None,
        typer.Option(
            "--plan", metavar="FILE", help="Plan to carry out; plan.json in the results by default."
        ),
    ] = None,
    out: ResultsFolder = None,
    gains: Annotated[
        str | None,
        typer.Option("--gains", metavar="NAME|FILE", help="Gain set or its file; the plan's own by default."),
    ] = None,
    *,
    options: RunOptions,
    apart: ApartOptions,
) -> None:
    """Map, simulate and record a plan that was made before."""
    task = read_task(scenario, gains, reporter)
    simulation = simulation_of(task, reporter, apart)
    folder = ResultFolder.of(task.name, out, "simulation")
    found = read_plan(task, plan or folder.plan, reporter, new_gains=gains is not None)
    with DrawingProcesses(figures=not options.no_figures) as drawing:
        reporter.code = carry_out(task, found, folder, reporter, drawing, simulation, options)


def read_plan(task: Task, path: Path, reporter: Reporter, *, new_gains: bool = False) -> Plan:
    """Read a plan that was made for this scenario; ``new_gains``: give it the scenario's selected gains.

    Raises:
        PlanError: The file is no plan, or belongs to another scenario.
    """
    from coop_drake.answers import load_plan
    from coop_drake.answers.plan import check_plan_belongs, other_age
    from coop_drake.planning import reschedule
    from coop_drake.plant.facts import scenario_budgets
    from coop_drake.verification.budget_origin import check_origin

    found = load_plan(path)
    check_plan_belongs(found, task.problem, path)
    if new_gains and found.motion is not None:
        allowed = "the plan of a team that rests in every cell, as `plan --gains` makes it, beside --gains"
        raise PlanError(f"{path}: its team passes from cell to cell; expected {allowed}")
    if new_gains:  # Also under the same name: a file may hold other gains than those of the plan.
        name = task.scenario.selected_gains
        found = reschedule(found, task.scenario.gain_sets[name], name)
    elif other := other_age(found, task.scenario.gain_sets.get(found.gain_set)):
        reporter.say(f"[yellow]{escape(str(path))}: {escape(other)}; `verify` will refuse the run[/]")
    try:
        check_origin(found.budget, scenario_budgets(task.scenario, task.problem))
    except RefusalError as error:
        reporter.say(f"[yellow]{escape(str(path))}: {escape(str(error))}; `verify` will refuse the run[/]")
    reporter.facts.update(
        answer="found", slices=0, first_plan_cpu_seconds=0.0, planning_cpu_seconds=0.0, **plan_facts(found)
    )
    return found
