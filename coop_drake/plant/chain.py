"""Finds the base of a robot, which is the root of its model, and its joints from the base outwards."""

from collections.abc import Callable
from functools import partial
from math import inf, isfinite

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, RigidBody

from coop_drake.errors import ScenarioError
from coop_drake.plant.parsing import bodies_of, joints_of, refusal
from coop_drake.scenario import RobotAssembly, Scenario

MOVABLE = ("revolute", "prismatic")

_ENDLESS = 1e3
"""Limits of this size or more count as none; files often write 1e16 for a joint without limits [rad or m]."""


def scoped(plant: MultibodyPlant, element: RigidBody | Joint) -> str:
    """Name of a body or joint with its model: ``robot_0::link_1``."""
    return f"{plant.GetModelInstanceName(element.model_instance())}::{element.name()}"


def find_base(
    scenario: Scenario, robot: RobotAssembly, plant: MultibodyPlant
) -> tuple[RigidBody, tuple[Joint, ...]]:
    """Find a robot's base body and its joints, and refuse models that are no holonomic planar manipulators.

    Args:
        scenario: For messages.
        robot: The robot.
        plant: A plant that holds the robot's models, finalized or not.

    Returns:
        The base body, and the movable joints in the order of q_k: from the base outwards, every joint before
        the joints that it carries.

    Raises:
        ScenarioError: A joint to the world, a joint that is neither fixed nor revolute nor prismatic, a joint
            without limits where limits are needed, or bodies that do not hang together.
    """
    refuse = partial(refusal, scenario, robot)
    bodies = bodies_of(plant, robot.models)
    members = {int(body.index()) for body in bodies}
    inner: list[Joint] = []
    for joint in joints_of(plant):
        ends = {int(joint.parent_body().index()), int(joint.child_body().index())}
        if ends & members and int(plant.world_body().index()) in ends:
            allowed = "a robot that no joint ties to the world; its base moves freely"
            raise refuse(scoped(plant, joint), allowed)
        if ends <= members:
            _check_kind(refuse, robot.name, plant, joint)
            inner.append(joint)
    children: set[int] = set()
    for joint in inner:
        child = joint.child_body()
        if int(child.index()) in children:
            allowed = f"exactly one joint that leads to {scoped(plant, child)}; no closed loop"
            raise refuse(scoped(plant, joint), allowed)
        children.add(int(child.index()))
    roots = [body for body in bodies if int(body.index()) not in children]
    if len(roots) != 1:
        names = ", ".join(scoped(plant, body) for body in roots) or "none"
        raise refuse(names, "one body that no joint leads to: the base")
    return roots[0], _outwards(roots[0], inner)


def limits_of(joint: Joint) -> tuple[float, float]:
    """Limits of a joint [rad or m], infinite where its model has none, as ``continuous`` joints of a URDF."""
    lower, upper = float(joint.position_lower_limits()[0]), float(joint.position_upper_limits()[0])
    return (lower if lower > -_ENDLESS else -inf, upper if upper < _ENDLESS else inf)


def is_circle(joint: Joint) -> bool:
    """Whether a joint is a circle: revolute, without limits."""
    return bool(joint.type_name() == "revolute" and limits_of(joint) == (-inf, inf))


def _check_kind(
    refuse: Callable[[str, str], ScenarioError], robot: str, plant: MultibodyPlant, joint: Joint
) -> None:
    name, kind, fixed = scoped(plant, joint), joint.type_name(), f"for it under fixed_joints.{robot}"
    if kind == "weld":
        return
    if kind not in MOVABLE:
        raise refuse(name, f"fixed, revolute or prismatic joints, not {kind}; or 0 {fixed}")
    lower, upper = limits_of(joint)
    if isfinite(lower) != isfinite(upper):
        one = f"upper limit {upper:g}" if isfinite(upper) else f"lower limit {lower:g}"
        raise refuse(
            name, f"two limits, or none for a revolute joint, not the {one} alone; or a value {fixed}"
        )
    if not isfinite(lower) and kind == "prismatic":
        raise refuse(name, f"prismatic joints with two finite limits; or a value {fixed}")
    if lower >= upper:
        raise refuse(name, f"a lower limit below the upper one, not {lower} and {upper}")


def _outwards(base: RigidBody, joints: list[Joint]) -> tuple[Joint, ...]:
    """The movable joints, depth first from the base; siblings in the order of the file."""
    ordered: list[Joint] = []
    stack = [int(base.index())]
    while stack:
        body = stack.pop()
        leading = [joint for joint in joints if int(joint.parent_body().index()) == body]
        stack.extend(int(joint.child_body().index()) for joint in reversed(leading))
        ordered.extend(joint for joint in joints if int(joint.child_body().index()) == body)
    return tuple(joint for joint in ordered if joint.type_name() in MOVABLE)
