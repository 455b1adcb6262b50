"""The command floor-plan: reads a drawing or a map, says what it is, writes a workspace and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer
from rich.markup import escape

from coop_drake.cli.options import out_file
from coop_drake.cli.reporter import Reporter

if TYPE_CHECKING:
    from coop_drake.floor_plans import FloorPlan
    from coop_drake.floor_plans.settings import Unit

_PICTURES = (".png", ".svg")
_SECTIONS = (".yaml", ".yml")

EXAMPLES = (
    ("floor-plan hall.dxf --unit mm --out hall.png", "look at a drawing"),
    (
        "floor-plan map.yaml --inside 2 3 --tolerance 0.05 --out workspace.yaml",
        "an occupancy map as a scenario's workspace; a scenario may name the file itself, too",
    ),
)


def floor_plan_command(
    reporter: Reporter,
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="*.svg, *.dxf, *.geojson, *.wkt, or a ROS map's *.yaml.")
    ],
    unit: Annotated[
        str | None, typer.Option("--unit", metavar="UNIT", help="Unit of the drawing: mm, cm, m, in, ft, …")
    ] = None,
    scale: Annotated[
        float, typer.Option("--scale", metavar="S", help="Factor on lengths, 50 for a drawing at 1:50.")
    ] = 1.0,
    layer: Annotated[
        list[str] | None, typer.Option("--layer", metavar="NAME", help="A layer to read; may be repeated.")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance",
            metavar="M",
            help="How many metres walls may grow to save corners; 0.01 by default.",
        ),
    ] = None,
    gap: Annotated[
        float, typer.Option("--gap", metavar="M", help="Gaps in outlines of up to so many metres are closed.")
    ] = 0.01,
    inside: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--inside", metavar="X Y", help="A point of the room in metres; the largest by default."
        ),
    ] = None,
    unknown_is_free: Annotated[
        bool, typer.Option("--unknown-is-free", help="Take a map's unknown cells for floor.")
    ] = False,
    out: Annotated[list[Path] | None, out_file("*.yaml: workspace; *.png or *.svg: picture.")] = None,
) -> None:
    """Read a floor plan that another program wrote: preview it, or turn it into a scenario's workspace."""
    targets = out or []
    for target in targets:
        if target.suffix.lower() not in (*_PICTURES, *_SECTIONS):
            raise typer.BadParameter(f"{target} ends neither in .yaml nor in .png or .svg.")
        if target.resolve() == file.resolve():
            raise typer.BadParameter(f"{target} is the floor plan itself.")
    from coop_drake.floor_plans import FloorPlanSettings, Inside, read_floor_plan

    settings = FloorPlanSettings(
        cast("Unit | None", unit), scale, tuple(layer or ()), tolerance, gap, unknown_is_free
    )
    with reporter.stage("reading"):
        plan = read_floor_plan(file, settings, Inside(*inside, "--inside") if inside else None)
    _tell(plan, file, reporter)
    for target in targets:
        _write(plan, file, target, inside)
        reporter.say(f"Written: {escape(str(target))}")


def _tell(plan: FloorPlan, file: Path, reporter: Reporter) -> None:
    """Note and show what was read."""
    x, y, right, top = plan.polygon.bounds
    taken = plan.drawn.area - plan.polygon.area
    corners, drawn = plan.corners
    reporter.facts.update(
        width_m=right - x,
        height_m=top - y,
        area_m2=plan.polygon.area,
        taken_m2=taken,
        obstacles=len(plan.polygon.interiors),
        corners=corners,
        corners_drawn=drawn,
        other_rooms=len(plan.others),
        notes=[],
    )
    rows = [
        ("from", f"({x:.3f}, {y:.3f}) m"),
        ("to", f"({right:.3f}, {top:.3f}) m"),
        ("floor", f"{plan.polygon.area:.2f} m²"),
        ("taken by walls", f"{taken:.2f} m²"),
        ("obstacles", f"{len(plan.polygon.interiors)}"),
        ("corners", f"{corners} of {drawn} drawn"),
    ]
    if plan.others:
        rows.append(("other rooms", f"{len(plan.others)}, the largest {plan.others[0]:.2f} m²"))
    reporter.table(file.name, rows)
    reporter.note(plan.notes)


def _write(plan: FloorPlan, file: Path, target: Path, inside: tuple[float, float] | None) -> None:
    from coop_drake.files import write_atomically
    from coop_drake.floor_plans import save_picture
    from coop_drake.floor_plans.settings import workspace_section

    if target.suffix.lower() in _PICTURES:
        save_picture(plan, target, file.name, inside)
    else:
        comment = f"Read from {file.name} by coop-drake floor-plan."
        write_atomically(target, workspace_section(plan.polygon, comment).encode())
