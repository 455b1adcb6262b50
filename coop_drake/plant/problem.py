"""The planning problem of a scenario: limits, start and goal, and that they are allowed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np
from pydrake.multibody.tree import Joint
from pydrake.systems.framework import DiagramBuilder
from shapely import LineString, Point, Polygon, get_coordinates
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem, TeamLimits, object_radius
from coop_drake.errors import ScenarioError
from coop_drake.plant.chain import limits_of
from coop_drake.plant.component_tree import base_points, read_component_tree
from coop_drake.plant.facts import moved_bodies
from coop_drake.plant.parsing import refusal
from coop_drake.plant.team import RobotModel, TeamPlant, build_team_plant
from coop_drake.scenario import Scenario, assemble
from coop_drake.scenario.deployment import ALL_ROBOTS
from coop_drake.scenario.model import OBJECT, RobotLimits
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import Body, ComponentTree, ConvexShape, PlanarPose

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

# Exact clearances of bodies to the walls and to each other at one configuration.


def core(shape: ConvexShape, X_WC: PlanarPose) -> BaseGeometry:
    """The hull of a shape without its radius, in W: a point, a segment or a polygon."""
    points = X_WC.apply(shape.vertices)
    if len(points) == 1:
        return Point(points[0])
    return LineString(points) if len(points) == 2 else Polygon(points)


def wall_clearance(body: Body, X_WC: PlanarPose, workspace: Polygon) -> float:
    """Signed distance of a body to the walls [m]: negative or zero where it leaves the workspace."""
    clearances = [float("inf")]
    for shape in body.shapes:
        solid = core(shape, X_WC)
        gap = workspace.boundary.distance(solid)
        if not workspace.contains(solid):
            corners = get_coordinates(solid.difference(workspace))
            gap = -max((Point(corner).distance(workspace) for corner in corners), default=0.0)
        clearances.append(gap - shape.radius)
    return min(clearances)


def body_clearance(first: Body, X_WC: PlanarPose, second: Body, X_WD: PlanarPose) -> float:
    """Distance between two bodies [m]; zero or negative where they touch or overlap."""
    return min(
        (
            float(core(a, X_WC).distance(core(b, X_WD))) - a.radius - b.radius
            for a in first.shapes
            for b in second.shapes
        ),
        default=float("inf"),
    )


def collisions(tree: ComponentTree, z: FloatArray, workspace: Polygon) -> Iterator[tuple[str, str, float]]:
    """Yield ``(body, what it hits, clearance)`` for every body that leaves the floor or touches another.

    ``z``: (x, y, theta, q...), shape (3 + n,).
    """
    poses = tree.poses(z)
    for X_WC, component in zip(poses, tree.components, strict=True):
        for body in component.bodies:
            clearance = wall_clearance(body, X_WC, workspace)
            if clearance <= 0.0:
                yield body.name, "the walls", clearance
    for (i, j), (k, m) in tree.collision_pairs:
        first, second = tree.components[i].bodies[j], tree.components[k].bodies[m]
        clearance = body_clearance(first, poses[i], second, poses[k])
        if clearance <= 0.0:
            yield first.name, second.name, clearance


def read_limits(team: TeamPlant, tree: ComponentTree) -> TeamLimits:
    """Read the limits of the joints, and where the bases' frames are.

    Raises:
        ScenarioError: A joint cannot move because a limit is zero.
    """
    components, points = base_points(team, tree)
    unknown, joints = np.full(len(team.robots), inf), _moving(team)
    return TeamLimits(
        base_components=components,
        base_points=tuple((float(x), float(y)) for x, y in points),
        base_speeds=unknown,
        turn_rates=unknown.copy(),
        joint_rates=_of_joints(team, joints, "velocity"),
        joint_accelerations=_of_joints(team, joints, "acceleration"),
        joint_efforts=np.array([_effort(team, joint) for _, joint, _ in joints]),
    )


def _moving(team: TeamPlant) -> list[tuple[RobotModel, Joint, str]]:
    """Return all joints in the order of q, each with its robot and its name."""
    return [
        (robot, joint, name)
        for robot in team.robots
        for joint, name in zip(robot.joints, robot.joint_names, strict=True)
    ]


def _of_joints(team: TeamPlant, joints: Sequence[tuple[RobotModel, Joint, str]], kind: str) -> FloatArray:
    """Return the smaller magnitude of the lower and the upper limit of every joint; infinity for none."""
    limits = []
    for robot, joint, name in joints:
        lower, upper = (
            getattr(joint, f"{kind}_lower_limits")()[0],
            getattr(joint, f"{kind}_upper_limits")()[0],
        )
        limits.append(float(min(-lower, upper)))
        if not limits[-1] > 0.0:
            models = team.assembly.robots[robot.index]
            allowed = f"a {kind} limit above zero, not {limits[-1] + 0.0:g}; or a value under fixed_joints"
            raise refusal(team.scenario, models, name, allowed)
    return np.array(limits)


def _effort(team: TeamPlant, joint: Joint) -> float:
    """Return the effort limit of a joint's motor, infinity for none [N m or N]."""
    plant = team.plant
    motors = (plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices())
    return min((float(m.effort_limit()) for m in motors if m.joint().index() == joint.index()), default=inf)


# Names joints whose kind and limits differ: continuous ones should have no limits, revolute ones two.


def limit_notes(root: Element, among: Collection[str] | None = None) -> list[str]:
    """Say of which joints of a model limits are kept or left aside although their kind says otherwise.

    ``root`` is that of the model's file, and ``among`` are the names of the joints that count, None for all.
    """
    endless, limited = list[str](), list[str]()
    for joint in root.iter("joint"):
        limit, kind, name = next(joint.iter("limit"), None), joint.get("type"), str(joint.get("name"))
        known = limit is not None and any(limit.get(k) or limit.findtext(k) for k in ("lower", "upper"))
        if among is None or name in among:
            endless += [name] if kind == "revolute" and not known else []
            limited += [name] if kind == "continuous" and known else []
    kept = "do not count" if root.tag == "sdf" else "are kept, so that these are no circles"
    notes = {
        "revolute joints without limits are circles, as continuous ones": endless,
        f"limits of continuous joints {kept}": limited,
    }
    return [f"{note}: {', '.join(names)}" for note, names in notes.items() if names]


def joint_notes(scenario: Scenario, problem: PlanningProblem) -> tuple[str, ...]:
    """Say the same of the joints that a scenario's team moves, each with the model's file."""
    moved = {joint.name.rpartition("::")[2] for joint in problem.tree.joints}
    models = [directive.add_model for directive in assemble(scenario).directives]
    files = dict.fromkeys(Path(model.file.removeprefix("file://")) for model in models if model)
    return tuple(
        f"{path.name}: {note}"
        for path in files
        for note in limit_notes(ElementTree.parse(path).getroot(), moved)
    )


# The planning problem that a scenario states about a team whose component tree is known.


def stated_problem(
    scenario: Scenario, tree: ComponentTree, joints: Mapping[str, int], limits: TeamLimits
) -> PlanningProblem:
    """Put floor, team, start and goal together.

    Args:
        scenario: The scenario; its joint values have been checked, or will be.
        tree: The team as seen from the object.
        joints: The robots in their order, each with its number of joints.
        limits: What the models say about limits.
    """
    start, goal = scenario.start, scenario.goal
    values = [value for robot in joints for value in start.joints.get(robot, ())]
    return PlanningProblem(
        workspace=scenario.workspace.polygon,
        tree=tree,
        start=np.array([start.object.x, start.object.y, start.object.theta, *values]),
        goal_pose=np.array([goal.object.x, goal.object.y, goal.object.theta]),
        goal_joints=tuple(
            value for robot, count in joints.items() for value in goal.joints.get(robot, (None,) * count)
        ),
        position_tolerance=goal.tolerances.position,
        angle_tolerance=goal.tolerances.angle,
        joint_tolerance=goal.tolerances.joint,
        settings=scenario.planner,
        limits=_stated_limits(scenario, joints, limits),
        passes=scenario.passes,
    )


def _stated_limits(scenario: Scenario, joints: Mapping[str, int], limits: TeamLimits) -> TeamLimits:
    """Limits of the models with those that the scenario states in their place."""
    speeds, turns = limits.base_speeds.copy(), limits.turn_rates.copy()
    rates, accelerations = limits.joint_rates.copy(), limits.joint_accelerations.copy()
    first = 0
    for k, (robot, count) in enumerate(joints.items()):
        stated = scenario.limits.get(robot, scenario.limits.get(ALL_ROBOTS, RobotLimits()))
        speeds[k] = speeds[k] if stated.base_speed is None else stated.base_speed
        turns[k] = turns[k] if stated.base_turn_rate is None else stated.base_turn_rate
        for values, given in ((rates, stated.joint_rates), (accelerations, stated.joint_accelerations)):
            for i, value in enumerate(given * count if len(given) == 1 else given):
                values[first + i] = values[first + i] if value is None else value
        first += count
    of_object = scenario.limits.get(OBJECT, RobotLimits()).acceleration
    return replace(
        limits,
        base_speeds=speeds,
        turn_rates=turns,
        joint_rates=rates,
        joint_accelerations=accelerations,
        base_accelerations=_of_bases(scenario, joints, "base_acceleration"),
        turn_accelerations=_of_bases(scenario, joints, "base_turn_acceleration"),
        base_jerks=_of_bases(scenario, joints, "base_jerk"),
        frictions=_of_bases(scenario, joints, "friction"),
        base_forces=np.full(len(joints), scenario.deployment.actuators.base_force or inf),
        object_acceleration=np.array([inf if of_object is None else of_object]),
    )


def _of_bases(scenario: Scenario, robots: Iterable[str], name: str) -> FloatArray:
    """Return a limit of every base that the scenario alone states; infinity for none."""
    rows = [scenario.limits.get(robot, scenario.limits.get(ALL_ROBOTS, RobotLimits())) for robot in robots]
    stated = [getattr(row, name) for row in rows]
    return np.array([inf if value is None else value for value in stated])


# Checks of a scenario that need its bodies and joints: joint values, start and goal.


def check_joints(scenario: Scenario, team: TeamPlant) -> None:
    """Refuse joint values that do not match the robots' joints and limits.

    Raises:
        ScenarioError: An unknown robot, a wrong number of values, a value outside its joint's limits.
    """
    _check_section(scenario, team, "start.joints", scenario.start.joints)
    tolerance = scenario.goal.tolerances.joint
    _check_section(scenario, team, "goal.joints", scenario.goal.joints, tolerance)
    _check_rates(scenario, team)
    count, given = sum(len(robot.joints) for robot in team.robots), scenario.deployment.start_offset.joints
    if given and len(given) != count:
        allowed = f"an empty list, or one of {count}, a number for every joint"
        raise ScenarioError(str(scenario.path), "deployment.start_offset.joints", list(given), allowed)
    for robot in team.robots:
        if robot.joints and robot.name not in scenario.start.joints:
            allowed = f"a list of {len(robot.joints)}, the values of {', '.join(robot.joint_names)}"
            raise ScenarioError(str(scenario.path), f"start.joints.{robot.name}", None, allowed)


def _check_section(
    scenario: Scenario,
    team: TeamPlant,
    key: str,
    section: Mapping[str, Sequence[float | None]],
    tolerance: float = 0.0,
) -> None:
    file = str(scenario.path)
    robots = {robot.name: robot for robot in team.robots}
    for name, values in section.items():
        if name not in robots:
            raise ScenarioError(file, f"{key}.{name}", name, "a robot, one of " + ", ".join(robots))
        robot = robots[name]
        if len(values) != len(robot.joints):
            names = ", ".join(robot.joint_names) or "no joints"
            allowed = f"a list of {len(robot.joints)}, the values of {names}"
            raise ScenarioError(file, f"{key}.{name}", list(values), allowed)
        for place, (value, joint) in enumerate(zip(values, robot.joints, strict=True)):
            lower, upper = limits_of(joint)
            if value is not None and not lower - tolerance <= value <= upper + tolerance:
                allowed = f"a value of {robot.joint_names[place]} between its limits {lower:g} and {upper:g}"
                allowed += (
                    f", or beyond one by the tolerance {tolerance:g} at most" if tolerance > 0.0 else ""
                )
                raise ScenarioError(file, f"{key}.{name}[{place}]", value, allowed)


def _check_rates(scenario: Scenario, team: TeamPlant) -> None:
    """Refuse limits of joints that are not as many as the joints."""
    for robot in team.robots:
        name = robot.name if robot.name in scenario.limits else ALL_ROBOTS
        stated = scenario.limits.get(name, RobotLimits())
        for key in ("joint_rates", "joint_accelerations"):
            given = getattr(stated, key)
            if len(given) not in (0, 1, len(robot.joints)):
                names = ", ".join(robot.joint_names) or "no joints"
                allowed = f"one for all joints, or a list of {len(robot.joints)}, for {names} of {robot.name}"
                raise ScenarioError(str(scenario.path), f"limits.{name}.{key}", list(given), allowed)


def check_places(scenario: Scenario, problem: PlanningProblem) -> None:
    """Refuse a start in collision, and a goal where the object leaves the floor by more than its tolerances.

    Raises:
        ScenarioError: With the bodies and their clearance.
    """
    file = str(scenario.path)
    for first, second, clearance in collisions(problem.tree, problem.start, problem.workspace):
        allowed = f"a configuration without collision ({first} touches {second}, clearance {clearance:.4f} m)"
        raise ScenarioError(file, "start", problem.start.tolist(), allowed)
    goal = scenario.goal.object.pose
    room = problem.position_tolerance + object_radius(problem.tree) * problem.angle_tolerance
    for body in problem.tree.components[0].bodies:
        # What is deeper inside a body than its points move within the tolerances stays in it.
        held = [core(shape, goal).buffer(shape.radius - room) for shape in body.shapes]
        if body.robot is None and any(
            not problem.workspace.contains(one) for one in held if not one.is_empty
        ):
            clearance = wall_clearance(body, goal, problem.workspace)
            found = f"{body.name} touches the walls, clearance {clearance:.4f} m"
            raise ScenarioError(
                file, "goal.object", [goal.x, goal.y, goal.angle], f"a pose inside the workspace ({found})"
            )


# Builds the planning problem from a scenario and its plant.


def planning_problem(scenario: Scenario, team: TeamPlant | None = None) -> PlanningProblem:
    """Put start, goal, walls and bodies together, and refuse inputs that are certainly mistakes.

    ``team`` is the plant that was built from the scenario; None to build it here.

    Raises:
        ScenarioError: Models that make no team, joints that do not fit the robots or their limits, a start in
            collision, a goal where the object leaves the floor, or bodies whose footprint cannot be read.
    """
    if team is None:
        team = build_team_plant(scenario, DiagramBuilder())
    check_joints(scenario, team)
    joints = {robot.name: len(robot.joints) for robot in team.robots}
    tree = read_component_tree(team)
    limits = replace(read_limits(team, tree), bodies=moved_bodies(scenario, team, tree))
    problem = stated_problem(scenario, tree, joints, limits)
    check_places(scenario, problem)
    return problem
