"""The command plan, and what every command does that plans: plan, write the answer, report it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape

from coop_drake.cli.options import BudgetName, Effort, GainsName, ResultsFolder, ScenarioPath
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.summary import answer_of, planning_facts, summary_rows
from coop_drake.cli.task import Task, read_task

if TYPE_CHECKING:
    from coop_drake.answers import Plan, PlanningResult

EXAMPLES = (
    ("plan models/base.scenario.yaml", "write out/base/plan.json and table_1.md"),
    ("plan models/base.scenario.yaml --effort 8", "eight times the work, for a quicker transport"),
    ("plan models/closed.scenario.yaml", "exit code 3 and a proof that there is no plan"),
)


def plan_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    out: ResultsFolder = None,
    gains: GainsName = None,
    budget: BudgetName = None,
    effort: Effort = None,
) -> None:
    """Plan only: write a plan, a way that breaks a limit, or a proof that there is none."""
    task = read_task(scenario, gains, reporter)
    folder = ResultFolder.of(task.name, out, "plan")
    if plan_of(task, folder, reporter, budget, effort=effort):
        reporter.table(task.name, summary_rows(reporter.facts, verbose=reporter.verbose))
        reporter.say(f"The plan is in {escape(str(folder.plan))}")


def plan_of(
    task: Task,
    folder: ResultFolder | None,
    reporter: Reporter,
    budget: str | None = None,
    *,
    effort: float | None = None,
) -> Plan | None:
    """Plan, and note the facts; without a plan say so, and set the exit code.

    It holds under the ``budget`` that the option of this name says, or else the scenario's ``deployment``;
    ``effort`` takes the place of the scenario's.
    The plan with its table of cells, a way that limits refuse, or the proof that there is none, goes to the
    folder if one is given.
    """
    result = answer_to(task, reporter, budget, effort=effort)
    return report_answer(task, result, folder, reporter)


def answer_to(
    task: Task,
    reporter: Reporter,
    budget: str | None = None,
    *,
    effort: float | None = None,
) -> PlanningResult:
    """Ask the planner, and note the facts; see ``plan_of``."""
    from coop_drake.memory import peak_memory_mb
    from coop_drake.planning.planner import plan

    name, tolerated = task.scenario.selected_gains, None
    if budget is not None or task.scenario.deployment.budget != "none":
        from coop_drake.plant.facts import budget_of

        tolerated = budget_of(budget, task.scenario, task.problem)
        required = task.scenario.deployment.budget
        if budget not in (None, required) and required != "none":
            said = f"--budget {budget}: the scenario requires the budget {required}"
            reporter.say(f"[yellow]{escape(said)}; `verify` will refuse the plan[/]")
    with reporter.stage("planning", "planning", cpu=True) as progress:
        gain_set = task.scenario.gain_sets[name]
        result = plan(
            task.problem, gain_set, gain_set_name=name, budget=tolerated, effort=effort, progress=progress
        )
    reporter.facts.update(planning_facts(result), peak_memory_mb=peak_memory_mb())
    return result


def report_answer(
    task: Task, result: PlanningResult, folder: ResultFolder | None, reporter: Reporter
) -> Plan | None:
    """Write an answer and return its plan; without a plan say so, and set the exit code."""
    from coop_drake.answers import Found

    if folder is not None:
        _write(result, task, folder)
    if isinstance(result, Found):
        return result.plan
    reporter.table(task.name, summary_rows(reporter.facts, verbose=reporter.verbose))
    reporter.say(f"[bold]{answer_of(result)}[/]: {escape(result.reason)}")
    for what, path in (("proof", folder.certificate), ("way", folder.way)) if folder is not None else ():
        if path.exists():
            reporter.say(f"The {what} is in {escape(str(path))}")
    if folder is not None:
        reporter.say(f"What blocks, and what would help: coop-drake why {escape(str(task.scenario.path))}")
    reporter.code = ExitCode.of(answer_of(result))
    return None


def _write(result: PlanningResult, task: Task, folder: ResultFolder) -> None:
    """Write the plan with its table of cells, a way that limits refuse, or the proof that there is none."""
    from coop_drake.answers import BeyondLimits, Found, Infeasible, save_plan, table_1
    from coop_drake.answers.proof import save_proof
    from coop_drake.files import write_atomically

    folder.begin("plan", "simulation")
    if isinstance(result, Found):
        save_plan(result.plan, folder.plan)
        write_atomically(folder.path / "table_1.md", table_1(result.plan).encode())
    elif isinstance(result, BeyondLimits):
        save_plan(result.plan, folder.way)
    elif isinstance(result, Infeasible) and result.proof is not None:
        save_proof(result.proof, task.problem, folder.certificate)
