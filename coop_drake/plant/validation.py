"""Checks of a scenario that need its bodies and joints: joint values, start and goal."""

from collections.abc import Mapping, Sequence

from coop_drake.answers.problem import PlanningProblem, object_radius
from coop_drake.errors import ScenarioError
from coop_drake.plant.chain import limits_of
from coop_drake.plant.placement import collisions, core, wall_clearance
from coop_drake.plant.team import TeamPlant
from coop_drake.scenario import Scenario
from coop_drake.scenario.limits import ALL_ROBOTS, RobotLimits


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
