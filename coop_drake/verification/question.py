"""The question as the exact checker reads it: all that leads there from a planning problem."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.answers.problem import PlanningProblem
from coop_drake.files import write_atomically
from coop_drake.tree.component_tree import Component, ComponentTree, PlanarPose

TRUSTED = (
    "the readers of the scenario, the plan and the proof (coop_drake/scenario, coop_drake/answers)",
    "how Drake parses the models (coop_drake/plant)",
    "the convex pieces, joints and pairs of bodies left aside that are read there, and their question "
    "(coop_drake/verification/question.py; --question FILE writes it)",
    "how a budget follows from the section deployment and the models (coop_drake/scenario, coop_drake/plant)",
    "the bounds of what departs under a budget, which the planner uses too (coop_drake/robustness)",
    "the rule by which a plan's gains follow from its cells, which the planner uses too (coop_drake/laws)",
    "the check of a plan's motion, in floating point (coop_drake/verification/motion.py, shapely)",
    "the simulation that estimates times of teams that rest, for limits that refuse a way "
    "(coop_drake/planning/duration.py)",
    "Python's integers, and the checker (coop_drake/checking)",
)
"""What remains to be trusted when the exact checker accepts an answer."""


def save_question(problem: PlanningProblem, path: Path | str) -> Path:
    """Write the question to a file, whole or not at all; return the path."""
    return write_atomically(path, (json.dumps(question_of(problem), allow_nan=False) + "\n").encode())


def question_of(problem: PlanningProblem) -> dict[str, Any]:
    """Write a planning problem down as a question for the checker: plain data for a JSON file.

    A joint that is a circle has null for its limits.
    """
    tree, goals = problem.tree, problem.goal_joints
    limits = [(None, None) if joint.circular else (joint.lower, joint.upper) for joint in tree.joints]
    ends = [own if goal is None else (goal, goal) for own, goal in zip(limits, goals, strict=True)]
    angle, joints = float(problem.goal_pose[2]), len(tree.joints)
    return {
        "format": "coop_drake question",
        "version": 3,
        "floor": _region(problem.workspace),
        "lower": [low for low, _ in limits],
        "upper": [high for _, high in limits],
        "components": [_component(component) for component in tree.components if component.joint is not None],
        "pieces": [
            {"body": body.name, "component": k, "corners": shape.vertices.tolist(), "radius": shape.radius}
            for k, component in enumerate(tree.components)
            for body in component.bodies
            for shape in body.shapes
        ],
        "left_aside": _left_aside(tree),
        "start": problem.start.tolist(),
        "goal": problem.goal_pose[:2].tolist(),
        "goal_lower": [angle, *[low for low, _ in ends]],
        "goal_upper": [angle, *[high for _, high in ends]],
        "tolerances": [
            problem.position_tolerance,
            problem.angle_tolerance,
            *[problem.joint_tolerance] * joints,
        ],
    }


def _region(polygon: Polygon) -> dict[str, Any]:
    rings = (polygon.exterior, *polygon.interiors)
    outer, *holes = (shapely.get_coordinates(ring)[:-1].tolist() for ring in rings)
    return {"outer": outer, "holes": holes}


def _component(component: Component) -> dict[str, Any]:
    """A component with a joint: its point p is at Rot(sign q + angle) p + q slide + offset in its parent."""
    joint = component.joint
    assert joint is not None
    revolute = joint.kind == "revolute"
    turned = PlanarPose(0.0, 0.0, joint.X_PJ.angle).apply(np.array(joint.axis))
    return {
        "parent": component.parent,
        "joint": joint.index,
        "sign": int(joint.sign) if revolute else 0,
        "angle": joint.X_PJ.angle,
        "slide": [0.0, 0.0] if revolute else turned.tolist(),
        "offset": [joint.X_PJ.x, joint.X_PJ.y],
    }


def _left_aside(tree: ComponentTree) -> list[list[Any]]:
    """Pairs of pieces that may overlap: a joint connects their components, or their models leave them aside.

    Pieces of one component never move against each other and are no pair.
    """
    owned = [(k, body.name) for k, c in enumerate(tree.components) for body in c.bodies for _ in body.shapes]
    unchecked, pairs = set(map(frozenset, tree.unchecked_pairs)), []
    for (i, (one, name)), (j, (other, another)) in combinations(enumerate(owned), 2):
        if one != other and frozenset((name, another)) in unchecked:
            joined = one == tree.components[other].parent or other == tree.components[one].parent
            pairs.append([i, j, "joint" if joined else "model"])
    return pairs
