"""The reconstructed scenario family, built without Drake: warehouses, teams and the five named cases."""

from __future__ import annotations

from math import pi

import numpy as np
from shapely import Polygon, box, normalize, union_all

from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint

GRASPS = (
    PlanarPose(0.4, 0.0, 0.0),
    PlanarPose(-0.4, 0.0, pi),
    PlanarPose(0.0, 0.25, pi / 2),
    PlanarPose(0.0, -0.25, -pi / 2),
)
GRIPPER_LENGTHS = (0.4, 0.4, 0.25, 0.25)
JOINT_LIMIT = 1.87
CASES = {
    "base": (1.2, 1.2, 2, 1),
    "tight": (0.9, 1.2, 2, 1),
    "closed": (0.77, 1.2, 2, 1),
    "three": (1.3, 1.5, 3, 1),
    "elbow": (1.2, 1.2, 2, 2),
}


def rectangle(x_lower: float, x_upper: float, y_lower: float, y_upper: float) -> ConvexShape:
    """Axis-aligned rectangle as a convex shape, counter-clockwise."""
    return ConvexShape(
        np.array([[x_lower, y_lower], [x_upper, y_lower], [x_upper, y_upper], [x_lower, y_upper]])
    )


def placed(shape: ConvexShape, X_PC: PlanarPose) -> ConvexShape:
    """The same shape measured in the parent's frame P."""
    return ConvexShape(X_PC.apply(shape.vertices), shape.radius)


def disc(radius: float, x: float = 0.0, y: float = 0.0) -> ConvexShape:
    """A disc as a convex shape of one vertex."""
    return ConvexShape(np.array([[x, y]]), radius)


def warehouse(w: float = 1.2, door: float = 1.2, robots: int = 2) -> Polygon:
    """The floor of the family: two rooms, a corridor of width ``w`` with a bend, a hall and a doorway."""
    s, h = (1.8, 3.0) if robots == 2 else (2.6, 3.4)
    rooms = [
        box(0.0, 0.0, s, 3.6),
        box(0.3, 3.5, 0.3 + w, 6.4),
        box(0.3, 6.4 - w, 3.5, 6.4),
        box(h, 2.4, 7.0, 6.4),
        box(5.0 - door / 2, 6.3, 5.0 + door / 2, 6.9),
        box(3.4, 6.8, 6.6, 10.0),
    ]
    clutter = [
        box(6.0, 2.4, 7.0, 3.4),
        Polygon([(4.6, 2.4), (5.2, 2.4), (4.9, 2.9)]),
        box(3.9, 9.5, 4.3, 9.8),
    ]
    floor = normalize(union_all(rooms).difference(union_all(clutter)).simplify(0.0))
    assert isinstance(floor, Polygon)
    return floor


def team_tree(robots: int = 2, joints_per_arm: int = 1) -> ComponentTree:
    """The object, carried by up to four robots whose arms have one or two revolute joints."""
    grippers = [_gripper(k, joints_per_arm) for k in range(robots)]
    carried = Body("object", None, (rectangle(-0.4, 0.4, -0.25, 0.25),))
    components = [Component("object", None, None, (carried, *grippers))]
    sharing: set[tuple[str, str]] = set()
    for k in range(robots):
        X_PJ = GRASPS[k] @ PlanarPose(_gripper_length(k, joints_per_arm))
        parent, parent_body = 0, f"robot_{k}::link_2"
        if joints_per_arm == 2:
            middle = Body(f"robot_{k}::middle", k, (rectangle(0.0, 0.2, -0.05, 0.05),))
            joint = _revolute(f"robot_{k}::joint_2", k, 2 * k + 1, X_PJ)
            components.append(Component(middle.name, parent, joint, (middle,)))
            sharing.add((middle.name, parent_body))
            X_PJ, parent, parent_body = PlanarPose(0.2), len(components) - 1, middle.name
        link = Body(f"robot_{k}::link_1", k, (rectangle(0.0, 0.35, -0.05, 0.05),))
        base = Body(f"robot_{k}::base", k, (disc(0.25, 0.35),))
        joint = _revolute(f"robot_{k}::joint_1", k, joints_per_arm * k, X_PJ)
        components.append(Component(link.name, parent, joint, (link, base)))
        sharing.add((link.name, parent_body))
    return ComponentTree(tuple(components), frozenset(sharing))


def _gripper_length(k: int, joints_per_arm: int) -> float:
    return 0.2 if joints_per_arm == 2 else GRIPPER_LENGTHS[k]


def _gripper(k: int, joints_per_arm: int) -> Body:
    shape = rectangle(-0.02, _gripper_length(k, joints_per_arm), -0.05, 0.05)
    return Body(f"robot_{k}::link_2", k, (placed(shape, GRASPS[k]),))


def _revolute(name: str, robot: int, index: int, X_PJ: PlanarPose) -> TreeJoint:
    """A joint whose model runs from the base outwards, so that the tree sees it turn the other way."""
    return TreeJoint(name, "revolute", robot, index, X_PJ, -1.0, (1.0, 0.0), -JOINT_LIMIT, JOINT_LIMIT)


def transport(
    w: float = 1.2,
    door: float = 1.2,
    robots: int = 2,
    joints_per_arm: int = 1,
    settings: PlannerSettings | None = None,
) -> PlanningProblem:
    """A member of the family: from the start room to the goal room, joints free at the goal."""
    joints = robots * joints_per_arm
    start = (0.9, 2.0, 1.57) if robots == 2 else (1.6, 2.0, 1.57)
    return PlanningProblem(
        workspace=warehouse(w, door, robots),
        tree=team_tree(robots, joints_per_arm),
        start=np.array([*start, *[0.0] * joints]),
        goal_pose=np.array([5.0, 8.0, 4.663]),
        goal_joints=(None,) * joints,
        settings=settings if settings is not None else PlannerSettings(),
    )


def case(name: str, settings: PlannerSettings | None = None) -> PlanningProblem:
    """One of the five named cases: base, tight, closed, three, elbow."""
    return transport(*CASES[name], settings=settings)
