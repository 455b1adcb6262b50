"""The command robot: prepares a model that others wrote, and lists which joints stay in the plane."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import out_folder
from coop_drake.cli.reporter import Reporter

if TYPE_CHECKING:
    from coop_drake.plant.importing import SurveyedJoint

EXAMPLES = (
    (
        "robot stretch4.urdf --gripper link_grasp_center --out models/stretch4",
        "model and meshes in one folder with a gripper frame, joints judged, lines for a scenario",
    ),
    (
        "robot pr2.urdf --package pr2_description=../pr2 --fix r_elbow_flex_joint=-0.3 --out models",
        "with a package's folder, and the axes behind a joint that will be fixed",
    ),
)


def robot_command(
    reporter: Reporter,
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="A *.urdf or *.sdf file; run xacro before.")],
    out: Annotated[Path, out_folder("A folder for model and meshes.")],
    package: Annotated[
        list[str] | None,
        typer.Option("--package", metavar="NAME=DIR", help="Where package://NAME leads; may be repeated."),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(
            "--fix", metavar="JOINT=VALUE", help="Show the axes of the other joints with this joint at VALUE."
        ),
    ] = None,
    gripper: Annotated[
        str | None,
        typer.Option(
            "--gripper",
            metavar="LINK",
            help="Add the gripper frame at this link's origin, upright, x pointing back to the base.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a model that is there already.")] = False,
) -> None:
    """Prepare a robot model that others wrote: meshes become hulls, all files go into one folder."""
    packages = {name: Path(folder) for name, folder in _pairs(package, "--package")}
    values = {name: _number(value) for name, value in _pairs(fix, "--fix")}
    from coop_drake.answers.motion import USUAL_LIMITS
    from coop_drake.errors import ScenarioError
    from coop_drake.files import write_atomically
    from coop_drake.plant.importing import (
        GRIPPER,
        has_gripper,
        import_robot,
        scenario_lines,
        survey_joints,
        with_gripper,
    )

    target = out / model.name
    if target.exists() and not force:
        raise ScenarioError(str(target), "--out", str(out), "a folder without this model, or --force")
    with reporter.stage("reading"):
        robot = import_robot(model, packages)
    for name, content in robot.files.items():
        write_atomically(out / name, content)
    joints = survey_joints(target, values)
    if gripper is not None:
        rest = {joint.name: joint.rest for joint in joints if joint.axis and joint.verdict != "planar"}
        write_atomically(target, with_gripper(target, gripper, rest))
    frame = GRIPPER if has_gripper(target) else "LINK"
    lines = scenario_lines(target, joints, frame)
    reporter.facts.update(
        model=str(target),
        notes=[],
        joints={joint.name: joint.verdict for joint in joints},
        scenario_lines=lines,
    )
    reporter.table(f"{model.name}: joints", [(joint.name, _words(joint)) for joint in joints])
    reporter.note(robot.notes)
    reporter.say(
        f"The model is {escape(str(target))}; a scenario uses it with these lines:\n\n{escape(lines)}"
    )
    reporter.say(f"Where `limits` in the scenario and the models state none: {USUAL_LIMITS}")
    if frame != GRIPPER:
        reporter.say(f"LINK: a link or frame of the model; --gripper LINK adds a frame {GRIPPER} there")


def _pairs(words: list[str] | None, option: str) -> list[tuple[str, str]]:
    pairs = []
    for word in words or []:
        name, equals, value = word.partition("=")
        if not (name and equals and value):
            raise typer.BadParameter(f"{option} {word} is not of the form NAME=VALUE.")
        pairs.append((name, value))
    return pairs


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"--fix: {text} is no number.") from None


def _words(joint: SurveyedJoint) -> str:
    axis = f" {joint.axis}, {joint.limits}" if joint.axis else ""
    return f"{joint.kind}{axis}: {joint.verdict}"
