"""The command reproduce: our runs of the paper's example, beside the numbers that the paper states."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

import coop_drake
from coop_drake.cli.options import out_folder
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.errors import CoopDrakeError

EXAMPLES = (("reproduce", "the paper's tables and figures beside ours, into out/reproduction/index.html"),)


def reproduce_command(
    reporter: Reporter,
    scenario: Annotated[
        Path | None,
        typer.Argument(
            metavar="[SCENARIO]", help="A scenario with the paper's team; the shipped base by default."
        ),
    ] = None,
    out: Annotated[Path, out_folder("Where the report goes.")] = Path("out/reproduction"),
) -> None:
    """Run the paper's example, draw what its Tables 1-2 and Figures 3-13 show, compare with its numbers."""
    _check_clone()
    # Here and not above: no other command should wait for Drake, and only a clone has the package `paper`.
    from coop_drake.cli.task import map_cache
    from coop_drake.scenario import load_scenario
    from paper import Agreement, gather, write_report

    task = load_scenario(scenario if scenario is not None else "base")
    with reporter.stage("simulating") as progress:
        material = gather(task, store=map_cache(), progress=progress)
    with reporter.stage("drawing") as progress:
        found = write_report(material, out, progress)
    statements = [statement for exhibit in found for statement in exhibit.statements]
    for agreement in Agreement:
        reporter.facts[agreement.name.lower()] = sum(one.agreement is agreement for one in statements)
    reporter.facts["exhibits"] = {exhibit.name: exhibit.agreement.value for exhibit in found}
    reporter.table(
        "The paper's example, reproduced",
        [(f"{exhibit.name}: {exhibit.title}", exhibit.agreement.value) for exhibit in found],
    )
    reporter.say(
        f"Open {escape(str(out / 'index.html'))} in a browser; {escape(str(out / 'report.md'))} is the same"
    )
    violations = [gains.violation for gains in material.played] + [run.log.violation for run in material.runs]
    for violation in filter(None, violations):
        reporter.complain(violation)
        reporter.code = ExitCode.FAILED_RUN


def _check_clone() -> None:
    """Refuse where the package ``paper`` is not there, as in an installed coop_drake."""
    root = Path(coop_drake.__file__).resolve().parent.parent
    if not (root / "paper" / "__init__.py").is_file():
        raise CoopDrakeError(
            f"{root}: paper: not found: an installed package comes without it; expected a clone of the "
            "repository, whose folder paper holds what this command runs"
        )
