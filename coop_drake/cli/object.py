"""The command object: the model of a polygonal object with mass, inertia and grasp frames."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import Machine, Quiet, out_folder
from coop_drake.cli.reporter import reporting


def _rows(text: str, count: int, option: str) -> list[list[float]]:
    """Parse rows of numbers: commas between rows, spaces between numbers."""
    try:
        rows = [[float(number) for number in row.split()] for row in text.split(",") if row.strip()]
    except ValueError as error:
        raise typer.BadParameter(f"{option}: {error}.") from None
    for row in rows:
        if len(row) != count:
            needed = f"{count} numbers; write commas between rows, spaces inside"
            raise typer.BadParameter(f"{option}: {row} should be {needed}.")
    return rows


def object_command(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the model and of its files.")],
    corners: Annotated[
        str,
        typer.Option("--corners", metavar="XY", help="The outline in metres, as one text: 'X Y, X Y, X Y'."),
    ],
    mass: Annotated[float, typer.Option("--mass", metavar="KG", help="Mass in kg.")],
    grasps: Annotated[
        str,
        typer.Option(
            "--grasps",
            metavar="FRAMES",
            help="Grasp frames, 'X Y FACING, X Y FACING' in metres and radians; x points outwards.",
        ),
    ] = "",
    height: Annotated[float, typer.Option("--height", metavar="M", help="Height in metres.")] = 0.2,
    elevation: Annotated[
        float,
        typer.Option("--elevation", metavar="M", help="Height of its middle over the floor: the grippers'."),
    ] = 0.4,
    inertia: Annotated[
        float | None,
        typer.Option(
            "--inertia",
            metavar="KG_M2",
            help="About the vertical through the centre of mass; that of uniform density by default.",
        ),
    ] = None,
    out: Annotated[Path, out_folder("The folder; this one by default.")] = Path(),
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there already.")] = False,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Write the model of a polygonal object: an SDF file, and a mesh for each convex part."""
    outline, frames = _rows(corners, 2, "--corners"), _rows(grasps, 3, "--grasps")
    if not name.replace("-", "_").isidentifier():
        raise typer.BadParameter(f"{name} is no name of letters, digits, - and _.")
    with reporting(machine=machine, quiet=quiet) as reporter:
        from coop_drake.errors import ScenarioError
        from coop_drake.plant.polygon_body import polygon_body_files, write_polygon_body

        files = polygon_body_files(
            outline, mass, name, height, inertia=inertia, elevation=elevation, grasps=frames
        )
        for file in files:
            if (out / file).exists() and not force:
                raise ScenarioError(str(out / file), "--out", str(out), "a folder without it, or --force")
        path = write_polygon_body(files, out)
        reporter.facts.update(model=str(path), files=sorted(str(out / file) for file in files))
        reporter.say(f"The model is {escape(str(path))}; a scenario uses it with these lines:\n")
        reporter.say(f"- add_model: {{name: object, file: {escape(path.as_posix())}}}")
        for k in range(len(frames)):
            reporter.say(f"- add_weld: {{parent: object::grasp_{k}, child: robot_{k}::gripper}}")
