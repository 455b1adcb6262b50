"""The question as the exact checker reads it: all that leads there from a planning problem."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import shapely
from shapely import Polygon

from coop_drake.answers.problem import PlanningProblem
from coop_drake.files import write_atomically
from coop_drake.tree.component_tree import Body, ComponentTree, TreeJoint

TRUSTED = (
    "how Drake parses the scenario and its models (coop_drake/scenario, coop_drake/plant)",
    "the convex pieces, joints and pairs of bodies left aside that are read there, and their question "
    "(coop_drake/verification/question.py; --question FILE writes it)",
    "Python's integers, and the checker (coop_drake/checking)",
)
"""What remains to be trusted when the exact checker accepts an answer."""


def save_question(problem: PlanningProblem, path: Path | str) -> Path:
    """Write the question to a file, whole or not at all; return the path."""
    return write_atomically(path, (json.dumps(question_of(problem), allow_nan=False) + "\n").encode())


def question_of(problem: PlanningProblem) -> dict[str, Any]:
    """Write a planning problem down as a question for the checker: plain data for a JSON file."""
    return {
        "format": "coop_drake question",
        "version": 1,
        "floor": _region(problem.workspace),
        "components": [
            {
                "parent": component.parent,
                "joint": None if component.joint is None else _joint(component.joint),
                "bodies": [_body(body) for body in component.bodies],
            }
            for component in problem.tree.components
        ],
        "left_aside": _left_aside(problem.tree),
        "start": problem.start.tolist(),
        "goal_pose": problem.goal_pose.tolist(),
        "goal_joints": list(problem.goal_joints),
        "position_tolerance": problem.position_tolerance,
        "angle_tolerance": problem.angle_tolerance,
        "joint_tolerance": problem.joint_tolerance,
    }


def _region(polygon: Polygon) -> dict[str, Any]:
    rings = (polygon.exterior, *polygon.interiors)
    outer, *holes = (shapely.get_coordinates(ring)[:-1].tolist() for ring in rings)
    return {"outer": outer, "holes": holes}


def _joint(joint: TreeJoint) -> dict[str, Any]:
    return {
        "name": joint.name,
        "kind": joint.kind,
        "robot": joint.robot,
        "index": joint.index,
        "frame": [joint.X_PJ.x, joint.X_PJ.y, joint.X_PJ.angle],
        "sign": int(joint.sign),
        "direction": list(joint.axis),
        "lower": joint.lower,
        "upper": joint.upper,
    }


def _body(body: Body) -> dict[str, Any]:
    shapes = [{"vertices": shape.vertices.tolist(), "radius": shape.radius} for shape in body.shapes]
    return {"name": body.name, "shapes": shapes}


def _left_aside(tree: ComponentTree) -> list[list[str]]:
    """Pairs of bodies that may overlap: a joint connects their components, or their models leave them aside.

    Bodies of one component never move against each other and are no pair.
    """
    owner = {body.name: k for k, component in enumerate(tree.components) for body in component.bodies}
    pairs = []
    for one, other in sorted(map(sorted, tree.unchecked_pairs)):
        first, last = sorted((owner[one], owner[other]))
        if first != last:
            joined = tree.components[last].parent == first
            pairs.append([one, other, "joint" if joined else "model"])
    return pairs
