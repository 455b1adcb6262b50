"""The command new: a scenario with its models, from a few flags or questions; and the model of an object."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from coop_drake.cli.options import FirstByDefault, command, out_folder
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.errors import ScenarioError

if TYPE_CHECKING:
    from coop_drake.answers import PlanningProblem

_QUESTIONS: tuple[tuple[str, str, Any], ...] = (
    ("robots", "How many robots", 2),
    ("arm", "Lengths of an arm's links from the base on [m], with a joint between each two", "0.35,0.4"),
    ("base_radius", "Radius of a base [m]", 0.25),
    ("length", "Length of the object [m]", None),
    ("width", "Width of the object [m]", 0.5),
)

EXAMPLES = (
    ("new mine --robots 3 --arm 0.3,0.3,0.3 --door 1.6", "a team and two rooms into mine/"),
    ("new hall --floor-plan hall.svg --unit cm --start 1 2 0 --goal 7 2 1.57", "on a floor of your own"),
    (
        "new object ell --corners '-0.4 -0.25, 0.4 -0.25, 0.4 0, -0.1 0, -0.1 0.25, -0.4 0.25' "
        "--mass 2 --grasps '0.4 -0.125 0, -0.4 0 3.1415926536'",
        "an L with two grasps, into ell.sdf and a mesh for each convex part",
    ),
)


new_app = typer.Typer(
    cls=FirstByDefault,
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Write a scenario with its models, or the model of a polygonal object, to start from.",
)
"""The command with those below it."""


@new_app.command("scenario")
@command
def scenario_command(
    reporter: Reporter,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of scenario and folder.")],
    robots: Annotated[
        int | None, typer.Option("--robots", metavar="N", help="Number of robots, 2 to 6; default 2.")
    ] = None,
    arm: Annotated[
        str | None,
        typer.Option(
            "--arm",
            metavar="L1,L2,…",
            help="Lengths of the arm's links from base to end effector in metres, with a joint between each "
            "two; default 0.35,0.4.",
        ),
    ] = None,
    base_radius: Annotated[
        float | None,
        typer.Option("--base-radius", metavar="M", help="Radius of a base in metres; default 0.25."),
    ] = None,
    length: Annotated[
        float | None,
        typer.Option(
            "--length",
            metavar="M",
            help="Length of the object in metres; default 0.8, or 1.4 for more than four robots.",
        ),
    ] = None,
    width: Annotated[
        float | None, typer.Option("--width", metavar="M", help="Width of the object in metres; default 0.5.")
    ] = None,
    door: Annotated[
        float | None,
        typer.Option(
            "--door",
            metavar="M",
            help="Width of the door between two rooms in metres; default: the team's width and 0.2 m on each "
            "side.",
        ),
    ] = None,
    floor_plan: Annotated[
        Path | None,
        typer.Option("--floor-plan", metavar="FILE", help="A drawing or map in place of two rooms."),
    ] = None,
    unit: Annotated[str | None, typer.Option("--unit", metavar="UNIT", help="Unit of the drawing.")] = None,
    scale: Annotated[
        float | None,
        typer.Option("--scale", metavar="S", help="Factor on the drawing's lengths, 50 for one at 1:50."),
    ] = None,
    layer: Annotated[
        list[str] | None,
        typer.Option("--layer", metavar="NAME", help="A layer of the drawing to read; may be repeated."),
    ] = None,
    start: Annotated[
        tuple[float, float, float] | None,
        typer.Option("--start", metavar="X Y THETA", help="Where the object starts, in metres and radians."),
    ] = None,
    goal: Annotated[
        tuple[float, float, float] | None,
        typer.Option("--goal", metavar="X Y THETA", help="Where it shall go, in metres and radians."),
    ] = None,
    out: Annotated[Path | None, out_folder("The folder; NAME by default.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there already.")] = False,
) -> None:
    """Write a scenario and its models to start from; at a terminal, ask for what no option says.

    `new NAME` means the same.
    """
    flags: dict[str, Any] = {
        "robots": robots,
        "arm": arm,
        "base_radius": base_radius,
        "length": length,
        "width": width,
    }
    if sys.stdin.isatty() and sys.stdout.isatty() and not reporter.silent:
        flags = _asked(flags)
    said: dict[str, Any] = {key: value for key, value in flags.items() if value is not None}
    if "arm" in said:
        said["links"] = _lengths(str(said.pop("arm")))
    _check_name(name)
    for flag, given in (("--unit", unit), ("--scale", scale), ("--layer", layer)):
        if given and floor_plan is None:
            raise typer.BadParameter(f"{flag} is for a floor plan; name it with --floor-plan.")
    folder = out if out is not None else Path(name)
    said.setdefault("length", _usual_length(said.get("robots", 2)))
    workspace = None if floor_plan is None else _section(floor_plan, unit, scale, layer, folder)
    starter = Starter(name, **said, door=door, workspace=workspace, start=start, goal=goal)
    reporter.code = _write(starter, folder, reporter, force=force)


def _asked(flags: dict[str, Any]) -> dict[str, Any]:
    """Ask for every value that no flag gave."""
    answers = dict(flags)
    for key, question, usual in _QUESTIONS:
        default = _usual_length(answers["robots"]) if usual is None else usual
        if flags[key] is None:
            answers[key] = typer.prompt(question, default=default, type=type(default))
    return answers


def _lengths(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"--arm {text} is no list of lengths such as 0.35,0.4.") from None


def _section(
    floor_plan: Path, unit: str | None, scale: float | None, layers: list[str] | None, folder: Path
) -> dict[str, object]:
    """How the scenario names the floor plan: relative to the folder that it will stand in."""
    file = Path(os.path.relpath(floor_plan, folder)).as_posix()
    said = {"file": file, "unit": unit, "scale": scale, "layers": layers}
    return {key: value for key, value in said.items() if value not in (None, [])}


def _refuse_blocked_goal(problem: PlanningProblem, path: Path) -> None:
    """Refuse a goal at which the team is proved to be in collision, whatever its free joints are."""
    from coop_drake.answers.problem import at_goal
    from coop_drake.planning.proofs import blocked_goal
    from coop_drake.plant.problem import collisions

    if blocked_goal(problem)[0] is None:
        return
    there = collisions(
        problem.tree, at_goal(problem.goal_pose, problem.goal_joints, problem.start[3:]), problem.workspace
    )
    found = "; ".join(f"{first} touches {second}" for first, second, _ in there)
    allowed = f"a pose at which the team fits ({found}, with joints as at the start)"
    raise ScenarioError(str(path), "goal.object", problem.goal_pose.tolist(), allowed)


def _write(starter: Starter, folder: Path, reporter: Reporter, *, force: bool) -> ExitCode:
    """Write the files beside their place, read them as a user would, and only then move them there."""
    from coop_drake.plant import planning_problem
    from coop_drake.plant.model_writing import object_model, robot_model
    from coop_drake.scenario import load_scenario

    files = {
        f"{starter.name}.scenario.yaml": _scenario_text(starter),
        "object.sdf": object_model(starter.length, starter.width, robots=starter.robots),
        "robot.sdf": robot_model("robot", starter.links, starter.base_radius),
    }
    for name in files:
        if (folder / name).exists() and not force:
            raise ScenarioError(str(folder / name), "--out", str(folder), "an empty folder, or --force")
    place = folder.resolve()  # That of "." has a parent and a name.
    place.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=place.parent, prefix=f".{place.name}.") as draft:
        for name, text in files.items():
            (Path(draft) / name).write_text(text, encoding="utf-8")
        path = Path(draft) / f"{starter.name}.scenario.yaml"
        try:
            with reporter.stage("checking"):
                path.write_text(_scenario_text(_with_absolute_plan(starter, place)), encoding="utf-8")
                scenario = load_scenario(path)
                _refuse_blocked_goal(planning_problem(scenario), path)
        except ScenarioError as error:  # The draft is gone when the message is read.
            named = error.file.replace(draft, str(folder))
            raise ScenarioError(named, error.key, error.value, error.allowed) from error
        path.write_text(files[path.name], encoding="utf-8")
        folder.mkdir(exist_ok=True)
        for name in files:
            (Path(draft) / name).replace(folder / name)
    reporter.note(scenario.workspace.notes)
    file = folder / f"{starter.name}.scenario.yaml"
    reporter.facts.update(scenario=str(file), files=sorted(str(folder / name) for name in files))
    reporter.say(f"Written: {', '.join(escape(str(folder / name)) for name in files)}")
    reporter.say(f"Next: coop-drake run {escape(str(file))}")
    return ExitCode.DONE


def _with_absolute_plan(starter: Starter, place: Path) -> Starter:
    """Name the floor plan by its absolute path, which a draft in another folder finds, too."""
    if starter.workspace is None:
        return starter
    file = str((place / str(starter.workspace["file"])).resolve())
    return replace(starter, workspace={**starter.workspace, "file": file})


# The scenario to start from: a team in two rooms with a door between them, or in a floor plan.

_CLEARANCE = 0.5
"""Distance between the walls of a room and the team in its middle [m]; the team can turn there."""

_WALL = 0.2
"""Thickness of the wall between the rooms [m], that of a usual partition."""

_DOOR_CLEARANCE = 0.2
"""Distance between the team and each side of the door, if no width is given [m]."""

_LENGTHS = 0.8, 1.4
"""Length of the object for up to four robots and for more, of which two stand at one side [m]."""

Pose = tuple[float, float, float]


@dataclass(frozen=True)
class Starter:
    """Dimensions of a new scenario.

    Attributes:
        name: Name of the scenario.
        robots: Number of robots, two to six.
        links: Lengths of an arm's links from the base's centre to the end effector [m].
        base_radius: Radius of a base [m].
        length: Length of the object [m].
        width: Width of the object [m].
        door: Width of the door between the two rooms [m]; None for the team's width and some clearance. A
            floor plan has no such door.
        workspace: The section ``workspace`` that names a floor plan; None for two rooms.
        start: Pose of the object (x, y, theta) [m, rad]; None for the middle of the first room.
        goal: Pose of the object (x, y, theta) [m, rad]; None for the middle of the second room.
    """

    name: str
    robots: int = 2
    links: tuple[float, ...] = (0.35, 0.4)
    base_radius: float = 0.25
    length: float = 0.8
    width: float = 0.5
    door: float | None = None
    workspace: Mapping[str, object] | None = None
    start: Pose | None = None
    goal: Pose | None = None

    def check(self) -> None:
        """Refuse dimensions that make no team.

        Raises:
            ScenarioError: Naming the option of the command line.
        """
        if not 2 <= self.robots <= 6:
            raise ScenarioError("coop-drake new", "--robots", self.robots, "two to six")
        if not 1 <= len(self.links) <= 4:
            raise ScenarioError("coop-drake new", "--arm", list(self.links), "one to four lengths")
        lengths = {"--base-radius": self.base_radius, "--length": self.length, "--width": self.width}
        lengths |= {"--arm": min(self.links), "--door": 1.0 if self.door is None else self.door}
        for flag, value in lengths.items():
            if not 0.05 <= value <= 10.0:
                raise ScenarioError("coop-drake new", flag, value, "a length between 0.05 and 10 m")
        if self.workspace and (self.start is None or self.goal is None):
            flag = "--start" if self.start is None else "--goal"
            raise ScenarioError("coop-drake new", flag, None, "X Y THETA, because there is a floor plan")

    @property
    def reach(self) -> float:
        """Distance from the object's middle to the far side of a base in front of it, arms straight [m]."""
        return 0.5 * self.length + sum(self.links) + self.base_radius

    @property
    def half_width(self) -> float:
        """Distance from the object's middle to the side of the team, arms straight [m]."""
        aside = sum(self.links) + self.base_radius if self.robots > 2 else 0.0
        return max(self.base_radius, 0.5 * self.width + aside)

    @property
    def room_size(self) -> float:
        """Edge of each of the two square rooms [m]."""
        return round(2.0 * (max(self.reach, self.half_width) + _CLEARANCE), 2)

    @property
    def doorway(self) -> float:
        """Width of the door [m]."""
        return round(2.0 * (self.half_width + _DOOR_CLEARANCE), 2) if self.door is None else self.door


def _usual_length(robots: int) -> float:
    """Length of the object if none is given, by the number of robots [m]."""
    return _LENGTHS[robots > 4]


def _scenario_text(starter: Starter) -> str:
    """Return the text of the scenario file; its models are ``object.sdf`` and ``robot.sdf`` beside it.

    Raises:
        ScenarioError: The dimensions make no team.
    """
    from coop_drake.answers import motion

    starter.check()
    size, joints = starter.room_size, len(starter.links) - 1
    start = starter.start or (0.5 * size, 0.5 * size, 1.57)
    goal = starter.goal or (1.5 * size + _WALL, 0.5 * size, 0.0)
    names = [f"robot_{k}" for k in range(starter.robots)]
    lines = [
        f"# {starter.name}: {starter.robots} robots carry a box. Metres and radians.",
        "# Check it with `coop-drake plan`, see it with `coop-drake run`.",
        *_rooms(starter),
        "",
        "directives:",
        "- add_model: {name: object, file: object.sdf}",
        *(f"- add_model: {{name: {name}, file: robot.sdf}}" for name in names),
        *(f"- add_weld: {{parent: object::grasp_{k}, child: {n}::gripper}}" for k, n in enumerate(names)),
        "",
        "start:",
        f"  object: {_pose(start)}",
        "  joints:" + (" {}" if not joints else ""),
        *(f"    {name}: {[0.0] * joints}" for name in names if joints),
        "",
        "goal:",
        f"  object: {_pose(goal)}  # joints are free",
        "  tolerances: {position: 0.01, angle: 0.02}",
        "",
        "# Those of usual mobile bases, in m/s, rad/s, m/s^2, rad/s^2, m/s^3; of the object in m/s^2.",
        "limits:",
        f'  "*": {{base_speed: {motion.BASE_SPEED:g}, base_turn_rate: {motion.TURN_RATE:g}, '
        f"base_acceleration: {motion.BASE_ACCELERATION:g}, "
        f"base_turn_acceleration: {motion.TURN_ACCELERATION:g}, base_jerk: {motion.BASE_JERK:g}, "
        f"friction: {motion.FRICTION:g}}}",
        f"  object: {{acceleration: {motion.OBJECT_ACCELERATION:g}}}",
    ]
    return "\n".join(lines) + "\n"


def _rooms(starter: Starter) -> list[str]:
    if starter.workspace:
        said = ", ".join(f"{key}: {json.dumps(value)}" for key, value in starter.workspace.items())
        return [f"workspace: {{{said}}}"]
    size, half = starter.room_size, 0.5 * min(starter.doorway, starter.room_size)
    low, high = _short(0.5 * size - half), _short(0.5 * size + half)
    near, far, end, top = _short(size), _short(size + _WALL), _short(2.0 * size + _WALL), _short(size)
    corners = [("0", "0"), (near, "0"), (near, low), (far, low), (far, "0"), (end, "0")]
    corners += [(end, top), (far, top), (far, high), (near, high), (near, top), ("0", top)]
    if half >= 0.5 * size:
        corners = [("0", "0"), (end, "0"), (end, top), ("0", top)]
    rings = ", ".join(f"[{x}, {y}]" for x, y in corners)
    return ["workspace:", f"  outer: [{rings}]  # two rooms and a door"]


def _pose(pose: Sequence[float]) -> str:
    x, y, theta = (_short(value) for value in pose)
    return f"{{x: {x}, y: {y}, theta: {theta}}}"


def _short(value: float) -> str:
    return f"{round(value, 6) + 0.0:g}"


# The model of an object.


@new_app.command("object")
@command
def object_command(
    reporter: Reporter,
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
) -> None:
    """Write the model of a polygonal object: an SDF file, and a mesh for each convex part."""
    outline, frames = _rows(corners, 2, "--corners"), _rows(grasps, 3, "--grasps")
    _check_name(name)
    from coop_drake.plant.model_writing import polygon_body_files, write_polygon_body

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


def _check_name(name: str) -> None:
    if not name.replace("-", "_").isidentifier():
        raise typer.BadParameter(f"{name} is no name of letters, digits, - and _.")


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
