"""The command verify: checks a plan, a proof of infeasibility or the log of a run by code of its own."""

from __future__ import annotations

from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import ScenarioPath
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.task import read_task
from coop_drake.errors import PlanError, RefusalError

if TYPE_CHECKING:
    from coop_drake.verification import Check

EXAMPLES = (
    ("verify out/base/plan.json models/base.scenario.yaml", "check a plan"),
    ("verify out/closed/certificate.json models/closed.scenario.yaml", "check a proof"),
    ("verify out/base/log.npz models/base.scenario.yaml", "check a run by its log"),
)


def verify_command(
    reporter: Reporter,
    certificate: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="plan.json, way.json or certificate.json, as `plan` wrote it, or log.npz of `run`.",
        ),
    ],
    scenario: ScenarioPath,
    plan: Annotated[
        Path | None,
        typer.Option(help="The plan that a log belongs to; plan.json beside the log if not given."),
    ] = None,
    braked: Annotated[
        bool,
        typer.Option(
            "--braked",
            help="For the log of a run in which all drives braked: check everything except that the team "
            "followed the plan.",
        ),
    ] = False,
    question: Annotated[
        Path | None,
        typer.Option(
            help="Write the scenario's question here, for `python -m coop_drake.checking QUESTION FILE`."
        ),
    ] = None,
) -> None:
    """Check a plan, a proof that there is none, or a run by its log, by code of its own."""
    task = read_task(scenario, reporter=reporter)
    if question is not None:
        from coop_drake.verification.question import save_question

        save_question(task.problem, question)
    if braked and certificate.suffix != ".npz":
        raise typer.BadParameter("--braked is about the log of a run, log.npz.")
    begun = process_time()
    try:
        with reporter.stage("verifying") as progress:
            if certificate.suffix == ".npz":
                from coop_drake.chain import verify_run

                followed = plan or certificate.with_name("plan.json")
                if plan is None and not followed.exists():
                    raise PlanError(f"{followed}: no such file; expected the plan of the log, or --plan FILE")
                verified = verify_run(certificate, followed, task.scenario, braked=braked, progress=progress)
            else:
                from coop_drake.plant.facts import scenario_budgets
                from coop_drake.verification import verify_file

                verified = verify_file(
                    certificate,
                    task.problem,
                    task.scenario.gain_sets,
                    progress,
                    budgets=scenario_budgets(task.scenario, task.problem),
                )
    except RefusalError as error:
        reporter.facts["valid"] = False
        reporter.complain(f"{certificate}: {error}", where=error.where, finding=error.finding)
        reporter.code = ExitCode.FAILED_RUN
        return
    reporter.facts.update(
        valid=True,
        verifying_cpu_seconds=round(process_time() - begun, 4),
        answer=verified.answer,
        subject=verified.subject,
        checks=[vars(check) for check in verified.checks],
        proved=verified.proved,
        not_proved=verified.not_proved,
    )
    headings = ("times", "closest to refusal")
    reporter.table(task.name, [_row(check) for check in verified.checks], headings, "checked")
    reporter.say(f"[bold]valid, {verified.answer}[/]: {escape(verified.subject)}")
    if certificate.suffix != ".npz":
        from coop_drake.verification.question import TRUSTED

        reporter.facts["trusted"] = list(TRUSTED)
        reporter.say(escape("To be trusted: " + "; ".join(TRUSTED)))
    reporter.say(escape(f"Proved: {verified.proved}. Not proved: {verified.not_proved}"))
    if verified.answer == "beyond limits":  # No answer to the question: another way may keep the limits.
        reporter.code = ExitCode.BEYOND_LIMITS


def _row(check: Check) -> tuple[str, str, str]:
    tightest = "" if check.tightest is None else f"{check.tightest:.3g} {check.unit}"
    return check.name, str(check.count), tightest
