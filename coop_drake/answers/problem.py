"""What the planner is asked: workspace, tree, start, goal and settings; plain data, no Drake."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np
from shapely import Polygon

from coop_drake.answers import motion
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import Bodies, Component, ComponentTree
from coop_drake.typed_data import Bounds, Limits, NotNegative, Positive


def _none() -> FloatArray:
    return np.empty(0)


@dataclass(frozen=True)
class TeamLimits:
    """What the robots' models and the scenario say about limits, N robots and n joints.

    Attributes:
        base_components: Of every robot the index of its base's component in the team's tree.
        base_points: Origin of the base's frame Bk in that component's frame [m].
        base_speeds: Largest speed of that origin in W, shape (N,) [m/s].
        turn_rates: Largest rate of the base's angle in W, shape (N,) [rad/s].
        joint_rates: Largest rate of every joint, shape (n,) [rad/s or m/s].
        joint_accelerations: Largest acceleration of every joint, shape (n,) [rad/s^2 or m/s^2].
        joint_efforts: Largest effort of every joint's motor, shape (n,) [N m or N].
        base_accelerations: Largest acceleration of the bases' origins, shape (N,) [m/s^2]; this and what
            follows is kept by motions that pass from cell to cell.
        turn_accelerations: Largest acceleration of the bases' angles, shape (N,) [rad/s^2].
        base_jerks: Largest jerk of the bases' origins, shape (N,) [m/s^3].
        object_acceleration: Largest acceleration of the object's origin, of shape (1,) [m/s^2].
        frictions: Largest force of every base over the weight of what it moves, shape (N,) [-].
        base_forces: Largest force of every base by its drives, shape (N,) [N].
        bodies: What every base moves: base, arm and its share of the load; empty where that is not known.
    """

    base_components: tuple[int, ...] = ()
    base_points: tuple[tuple[float, float], ...] = ()
    base_speeds: Bounds = field(default_factory=_none)
    turn_rates: Bounds = field(default_factory=_none)
    joint_rates: Bounds = field(default_factory=_none)
    joint_accelerations: Bounds = field(default_factory=_none)
    joint_efforts: Bounds = field(default_factory=_none)
    base_accelerations: Bounds = field(default_factory=_none)
    turn_accelerations: Bounds = field(default_factory=_none)
    base_jerks: Bounds = field(default_factory=_none)
    object_acceleration: Bounds = field(default_factory=_none)
    frictions: Bounds = field(default_factory=_none)
    base_forces: Bounds = field(default_factory=_none)
    bodies: Bodies = ()

    @property
    def any(self) -> bool:
        """Whether there is a limit of a speed or rate."""
        return bool(np.isfinite(np.concatenate((self.base_speeds, self.turn_rates, self.joint_rates))).any())

    def usual(self, joints: int) -> TeamLimits:
        """Return the usual limits of this team, whatever is stated, for so many joints."""
        return TeamLimits(self.base_components, self.base_points, bodies=self.bodies).with_defaults(joints)

    def with_defaults(self, joints: int | None = None) -> TeamLimits:
        """Return the limits of a team that passes from cell to cell: usual ones where nothing is stated.

        Args:
            joints: Number of joints, for a team of which no joint states anything.
        """

        def known(stated: FloatArray, count: int, otherwise: float) -> FloatArray:
            stated = stated if stated.size else np.full(count, np.inf)
            return np.where(np.isfinite(stated), stated, otherwise)

        bases, joints = len(self.base_components), joints or len(self.joint_rates)
        return replace(
            self,
            base_speeds=known(self.base_speeds, bases, motion.BASE_SPEED),
            turn_rates=known(self.turn_rates, bases, motion.TURN_RATE),
            joint_rates=known(self.joint_rates, joints, motion.JOINT_RATE),
            joint_accelerations=known(self.joint_accelerations, joints, motion.JOINT_ACCELERATION),
            base_accelerations=known(self.base_accelerations, bases, motion.BASE_ACCELERATION),
            turn_accelerations=known(self.turn_accelerations, bases, motion.TURN_ACCELERATION),
            base_jerks=known(self.base_jerks, bases, motion.BASE_JERK),
            object_acceleration=known(self.object_acceleration, 1, motion.OBJECT_ACCELERATION),
            frictions=known(self.frictions, bases, motion.FRICTION),
            base_forces=known(self.base_forces, bases, np.inf),
        )


LIMIT_ROOM = 0.01
"""A joint may be planned this far around its start and its goal, even beyond a limit [rad].

A funnel needs room on both sides. For a prismatic joint it is this number times the object's radius.
"""

ROUNDING = 1e-9
"""A start or goal that misses a limit by no more than this is within it [rad or m]."""


@dataclass(frozen=True)
class PlannerSettings:
    """How hard the planner tries.

    Attributes:
        margin: Largest margin that ``portfolio`` keeps where it can. Scaled for very large or very small
            teams [m].
        slice_overlap: Overlap of neighbouring slices over their width, for under-cells only.
        angle_resolution: Slices of angles are not split below this width [rad].
        length_resolution: Slices of prismatic joints are not split below this width [m].
        max_slices: Work budget: no exploration begins once all of them have made so many slices. The last
            exploration may exceed it.
        min_clearance: Least clearance of the object's path in a cell (half the passage), and of the target.
            Narrower ones take minutes. Scaled for very large or very small teams [m].
        max_transition_time: Longest estimated time of one transition that is accepted [s].
        effort: Work spent on a quicker transport: 0 takes the first path that is found, 2 is twice the
            default. It counts samples and moves, not seconds.
        strategy: ``portfolio`` samples, certifies and proves; ``cells`` explores by cells alone, and
            ``paper`` as the paper's algorithms are printed, both at margin zero.
    """

    margin: NotNegative = 0.1
    slice_overlap: Annotated[float, Limits(at_least=0.0, at_most=1.0)] = 0.25
    angle_resolution: Positive = 0.002
    length_resolution: Positive = 0.001
    max_slices: Annotated[int, Limits(above=0)] = 4_000
    min_clearance: Positive = 0.001
    max_transition_time: Positive = 60.0
    effort: Annotated[float, Limits(at_least=0.0, at_most=1000.0)] = 1.0
    strategy: Literal["portfolio", "cells", "paper"] = "portfolio"


@dataclass(frozen=True, eq=False)
class PlanningProblem:
    """One question to the planner; questions are equal only if they are the same object.

    A joint that starts or is to end nearer to a limit than ``LIMIT_ROOM``, or that cannot move, may be
    planned up to so much beyond that limit, everywhere on the way: plans and proofs are about these wider
    limits. A question whose start or goal is itself beyond a limit keeps the limits as they are. A joint
    without limits is a circle.

    The goal is a closed set: positions in the disc of the position's tolerance, and ``goal_box``.

    Attributes:
        workspace: The floor W, outer ring and holes [m].
        tree: The team as seen from the object outwards, with that room.
        start: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        goal_pose: (x, y, theta) of the object, shape (3,); theta is taken modulo 2 pi.
        goal_joints: Goal value of each joint, None where the joint is free, length n; those of joints without
            limits are taken modulo 2 pi.
        position_tolerance: Final position tolerance [m].
        angle_tolerance: Final angle tolerance [rad].
        joint_tolerance: Final tolerance of joints that have a goal, of all or of each, shape (n,) [rad or m].
        settings: How hard to try.
        limits: Largest speeds of bases and joints.
        passes: Whether the team passes from cell to cell without a stop, at a pace from which it can stop;
            otherwise it rests in every cell before it enters the next one, as the paper's does.
        roomy: Whether joints at their limits are given room; False for variants of a question.
    """

    workspace: Polygon
    tree: ComponentTree
    start: FloatArray
    goal_pose: FloatArray
    goal_joints: tuple[float | None, ...]
    position_tolerance: float = 0.01
    angle_tolerance: float = 0.02
    joint_tolerance: float | FloatArray = 0.02
    settings: PlannerSettings = field(default_factory=PlannerSettings)
    limits: TeamLimits = field(default_factory=TeamLimits)
    passes: bool = False
    roomy: bool = True

    @property
    def kept_limits(self) -> TeamLimits:
        """The limits that the team keeps: those that are known, and usual ones where it passes."""
        return self.limits.with_defaults(len(self.tree.joints)) if self.passes else self.limits

    def __post_init__(self) -> None:
        """Give room to joints at their limits."""
        joints = [component.joint for component in self.tree.components if component.joint is not None]
        known = min(len(self.start) - 3, len(self.goal_joints))
        if self.roomy and all(joint.index < known for joint in joints):
            roomy = tuple(map(self._with_room, self.tree.components))
            if any(new is not old for new, old in zip(roomy, self.tree.components, strict=True)):
                object.__setattr__(self, "tree", replace(self.tree, components=roomy))

    def _with_room(self, component: Component) -> Component:
        """The component, its joint with room about its start and its goal; the same where it has that."""
        joint = component.joint
        if joint is None:
            return component
        room = LIMIT_ROOM if joint.kind == "revolute" else LIMIT_ROOM * object_radius(self.tree)
        ends = (float(self.start[3 + joint.index]), self.goal_joints[joint.index])
        values = [value for value in ends if value is not None]
        if not all(joint.lower - ROUNDING <= value <= joint.upper + ROUNDING for value in values):
            return component
        lower = min([joint.lower, *[value - room for value in values]])
        upper = max([joint.upper, *[value + room for value in values]])
        if (lower, upper) == (joint.lower, joint.upper):
            return component
        return replace(component, joint=replace(joint, lower=lower, upper=upper))


def goal_box(problem: PlanningProblem) -> tuple[tuple[float, float], ...]:
    """The goal's intervals of (theta, q...) [rad or m].

    They are as wide as the tolerances say, those of joints clipped to their limits; joints without a goal
    have their whole range. Values of circular axes are modulo a turn. The interval of a joint whose goal is
    further beyond a limit is empty: its lower end is above its upper end.
    """
    joints, angle = problem.tree.joints, float(problem.goal_pose[2])
    rooms = np.broadcast_to(problem.joint_tolerance, len(joints)).tolist()
    ends = [
        joint.range if goal is None else (max(goal - room, joint.lower), min(goal + room, joint.upper))
        for joint, goal, room in zip(joints, problem.goal_joints, rooms, strict=True)
    ]
    return ((angle - problem.angle_tolerance, angle + problem.angle_tolerance), *ends)


def at_goal(
    goal_pose: FloatArray, goal_joints: tuple[float | None, ...], free: FloatArray | float
) -> FloatArray:
    """Configuration z at the goal, shape (3 + n,); joints without a goal get the values of ``free``."""
    joints = np.array([np.nan if goal is None else goal for goal in goal_joints], dtype=float)
    return np.concatenate((goal_pose, np.where(np.isnan(joints), free, joints)))


def object_radius(tree: ComponentTree) -> float:
    """Distance of the furthest point of the object, with what is welded to it, from its origin [m]."""
    shapes = [shape for body in tree.components[0].bodies for shape in body.shapes]
    return max(float(np.hypot(*shape.vertices.T).max()) + shape.radius for shape in shapes)
