"""Digests: which question a file answers, and whether its content is still what was written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from typing import Any

import numpy as np
import shapely

from coop_drake.answers.problem import PlanningProblem, TeamLimits
from coop_drake.tree.component_tree import Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.typed_data import to_plain

DECIMALS = 9
"""Decimals of a problem's numbers that its digest sees [m, rad]: last bits differ between libraries."""


def content_digest(document: Mapping[str, Any]) -> str:
    """SHA-256 over all of a JSON document but its entry ``digest``, whatever its layout; in hexadecimal."""
    return _digest({key: value for key, value in document.items() if key != "digest"})


def problem_digest(problem: PlanningProblem) -> str:
    """SHA-256 over what is asked: floor, team, start, goal, tolerances and limits; not how hard to try."""
    rings = (problem.workspace.exterior, *problem.workspace.interiors)
    return _digest(
        {
            "workspace": [_rounded(shapely.get_coordinates(ring).tolist()) for ring in rings],
            "team": tree_document(problem.tree),
            "start": _rounded(problem.start.tolist()),
            "goal_pose": _rounded(problem.goal_pose.tolist()),
            "goal_joints": _rounded(list(problem.goal_joints)),
            "tolerances": _rounded(
                [
                    problem.position_tolerance,
                    problem.angle_tolerance,
                    *np.atleast_1d(problem.joint_tolerance).tolist(),
                ]
            ),
            **_limits(problem.limits),
        }
    )


def tree_document(tree: ComponentTree) -> dict[str, Any]:
    """A component tree as plain data with rounded numbers."""
    return {
        "components": [_component(component) for component in tree.components],
        "sharing_joint": sorted(sorted(pair) for pair in tree.unchecked_pairs),
    }


def _limits(limits: TeamLimits) -> dict[str, Any]:
    """Limits of speed and of acceleration, if there are any; efforts are not part of the question."""
    stated, document = to_plain(limits, TeamLimits), {}
    accelerations = stated.pop("joint_accelerations")
    del stated["joint_efforts"]
    if limits.any:
        document["limits"] = _rounded(list(stated.values()))
    if np.isfinite(limits.joint_accelerations).any():
        document["accelerations"] = _rounded(accelerations)
    return document


def _digest(value: Any) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return sha256(text.encode()).hexdigest()


def _rounded(value: Any) -> Any:
    """The same nested lists with rounded numbers, without negative zeros."""
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    return None if value is None else round(float(value), DECIMALS) + 0.0


def _component(component: Component) -> dict[str, Any]:
    return {
        "name": component.name,
        "parent": component.parent,
        "joint": None if component.joint is None else _joint(component.joint),
        "bodies": [
            [body.name, body.robot, [_shape(shape) for shape in body.shapes]] for body in component.bodies
        ],
    }


def _joint(joint: TreeJoint) -> list[Any]:
    X = joint.X_PJ
    numbers = [X.x, X.y, X.angle, joint.sign, *joint.axis, joint.lower, joint.upper]
    return [joint.name, joint.kind, joint.robot, joint.index, _rounded(numbers)]


def _shape(shape: ConvexShape) -> list[Any]:
    return [_rounded(shape.vertices.tolist()), _rounded(shape.radius)]
