"""The command compare: one plan on the exact plant and on one of separate robots, margins side by side."""

from __future__ import annotations

import json
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from rich.markup import escape

from coop_drake.cli.maps import map_cells
from coop_drake.cli.options import GainsName, Machine, Quiet, ScenarioPath, out_folder
from coop_drake.cli.plan import plan_of
from coop_drake.cli.reporter import ExitCode, Reporter, reporting
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.summary import simulation_facts
from coop_drake.cli.task import Task, read_task

if TYPE_CHECKING:
    from coop_drake.answers import Plan
    from coop_drake.fields import HarmonicMap

_PLANTS: tuple[tuple[Literal["joints", "constraints"], str], ...] = (
    ("joints", "one tree, grasps rigid"),
    ("constraints", "a tree each, grasps constraints"),
)
_ROWS = (
    ("simulated", "simulated_seconds", "{:.2f} s"),
    ("final position error", "final_position_error_m", "{:.4f} m"),
    ("final angle error", "final_angle_error_rad", "{:.4f} rad"),
    ("smallest clearance to the walls", "min_workspace_clearance_m", "{:.4f} m"),
    ("smallest clearance between bodies", "min_body_clearance_m", "{:.4f} m"),
    ("smallest clearance in a cell", "min_cell_clearance_m", "{:.4f} m"),
    ("smallest funnel margin", "min_funnel_margin", "{:.4f} rad"),
    ("smallest energy margin", "min_delta_e", "{:.3e} m²/s²"),
    ("largest grasp error", "max_grasp_error_m", "{:.1e} m"),
    ("largest acceleration error", "max_acceleration_error", "{:.1e} m/s²"),
    ("largest wrench error", "max_wrench_error_n", "{:.1e} N"),
    ("governors' largest difference", "max_governor_spread_m", "{:.1e} m"),
    ("peak base force", "peak_base_wrench_n", "{:.1f} N"),
)


def compare_command(
    scenario: ScenarioPath,
    out: Annotated[
        Path | None, out_folder("Where plan and comparison go; out/<scenario>/compare by default.")
    ] = None,
    gains: GainsName = None,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Carry a plan out with exactly rigid grasps and with constraints as grasps; compare the margins."""
    with reporting(machine=machine, quiet=quiet) as reporter:
        reporter.code = _compare(scenario, gains, out, reporter)


def _compare(scenario: Path, gains: str | None, out: Path | None, reporter: Reporter) -> ExitCode:
    from coop_drake.files import write_atomically

    task = read_task(scenario, gains, reporter)
    folder = ResultFolder.of(task.name, out, "plan", "comparison", below="compare")
    plan = plan_of(task, folder, reporter)
    if plan is None:
        return reporter.code
    maps = map_cells(task, plan, reporter)
    measures = [_measures(task, plan, maps, grasps, reporter) for grasps, _ in _PLANTS]
    compared: dict[str, Any] = {grasps: facts for (grasps, _), facts in zip(_PLANTS, measures, strict=True)}
    folder.begin("comparison")
    write_atomically(folder.path / "compare.json", json.dumps(compared, indent=1).encode() + b"\n")
    reporter.facts.update(compared)
    rows = [(label, *(_text(facts[key], form) for facts in measures)) for label, key, form in _ROWS]
    reporter.table(task.name, rows, [heading for _, heading in _PLANTS])
    reporter.say(f"These figures are also in the JSON file {escape(str(folder.path / 'compare.json'))}")
    for (_, heading), facts in zip(_PLANTS, measures, strict=True):
        if facts["violation"]:
            reporter.complain(f"{heading}: {facts['violation']}")
    return ExitCode.DONE if all(facts["reached"] for facts in measures) else ExitCode.FAILED_RUN


def _measures(
    task: Task,
    plan: Plan,
    maps: tuple[HarmonicMap, ...],
    grasps: Literal["joints", "constraints"],
    reporter: Reporter,
) -> dict[str, Any]:
    from coop_drake.simulation import simulate

    plant = replace(task.scenario.plant, grasps=grasps)
    with reporter.stage("simulating") as progress:
        log = simulate(replace(task.scenario, plant=plant), plan, maps, progress=progress)
    measures = simulation_facts(plan, log, task.problem)
    # JSON has no infinities: where nothing can touch, there is no smallest clearance.
    return {
        key: None if isinstance(value, float) and not isfinite(value) else value
        for key, value in measures.items()
    }


def _text(value: Any, form: str) -> str:
    return "-" if value is None else form.format(value)
