"""What the planner is asked: workspace, tree, start, goal and settings; plain data, no Drake."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from shapely import Polygon

from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.tree import ComponentTree


@dataclass(frozen=True)
class PlannerSettings:
    """How hard the planner tries.

    Attributes:
        margin: First margin rho tried [m]; halved until a plan is found, 0 last.
        slice_overlap: Overlap of neighbouring slices as a fraction of their width, for under-cells only.
        angle_resolution: Slices of angles are not split below this width [rad].
        length_resolution: Slices of prismatic joints are not split below this width [m].
        max_slices: Work budget of one attempt, in slices made.
        max_transition_time: Longest estimated time of one transition that is accepted [s].
        strategy: ``portfolio`` samples, certifies and proves; ``cells`` explores by cells alone; ``paper``
            explores as the paper's Algorithms 1 and 2 are printed, at margin zero.
    """

    margin: float = 0.1
    slice_overlap: float = 0.25
    angle_resolution: float = 0.002
    length_resolution: float = 0.001
    max_slices: int = 4_000
    max_transition_time: float = 60.0
    strategy: Literal["portfolio", "cells", "paper"] = "portfolio"


@dataclass(frozen=True)
class PlanningProblem:
    """One question to the planner.

    Attributes:
        workspace: The floor W, outer ring and holes [m].
        tree: The team as seen from the object outwards.
        start: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        goal_pose: (x, y, theta) of the object, shape (3,); theta is taken modulo 2 pi.
        goal_joints: Goal value of each joint, None where the joint is free, length n.
        position_tolerance: Final position tolerance [m].
        angle_tolerance: Final angle tolerance [rad].
        joint_tolerance: Final tolerance of joints that have a goal [rad or m].
        settings: How hard to try.
    """

    workspace: Polygon
    tree: ComponentTree
    start: FloatArray
    goal_pose: FloatArray
    goal_joints: tuple[float | None, ...]
    position_tolerance: float = 0.01
    angle_tolerance: float = 0.02
    joint_tolerance: float = 0.02
    settings: PlannerSettings = field(default_factory=PlannerSettings)
