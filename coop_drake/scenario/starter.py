"""Writes a scenario to start from: a team in two rooms with a door between them, or in a floor plan."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from coop_drake.answers import motion
from coop_drake.errors import ScenarioError

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


def usual_length(robots: int) -> float:
    """Length of the object if none is given, by the number of robots [m]."""
    return _LENGTHS[robots > 4]


def starter_text(starter: Starter) -> str:
    """Return the text of the scenario file; its models are ``object.sdf`` and ``robot.sdf`` beside it.

    Raises:
        ScenarioError: The dimensions make no team.
    """
    starter.check()
    size, joints = starter.room_size, len(starter.links) - 1
    start = starter.start or (0.5 * size, 0.5 * size, 1.57)
    goal = starter.goal or (1.5 * size + _WALL, 0.5 * size, 0.0)
    names = [f"robot_{k}" for k in range(starter.robots)]
    lines = [
        f"# {starter.name}: {starter.robots} robots carry a box. Metres and radians.",
        "# Check it with `coop-drake plan`, see it with `coop-drake run`.",
        *_workspace(starter),
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


def _workspace(starter: Starter) -> list[str]:
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
