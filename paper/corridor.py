"""A plan with the intervals of Table 1: its cells lie in a straight line in an empty hall.

The paper prints the intervals of its cells and not their polygons. Here every cell is a square, and each is
one step further along the hall, so that angles, joints and the position all have to move.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shapely import box

from coop_drake.answers import PlanningProblem
from coop_drake.answers.plan import Plan
from coop_drake.errors import ScenarioError
from coop_drake.laws import GainSet
from coop_drake.planning.cells.cells import FreeBox
from coop_drake.planning.channel import Channel
from coop_drake.planning.transitions import make_plan
from coop_drake.scenario import Goal, ObjectPose, Scenario, Start, Tolerances, Workspace, with_gains
from paper.table_1 import ANGLE_TOLERANCE, CORRECTED, GOAL_ANGLE, START

__all__ = ["corridor_plan", "corridor_scenario"]

_STEP, _HALF, _BORDER = 0.3, 0.5, 4.0
"""Distance of neighbouring cells, half a cell's side, and border of the hall [m]."""


def corridor_scenario(scenario: Scenario) -> Scenario:
    """Return the scenario's team in the hall, from the start of Table 1 to its goal; it rests in every cell.

    Args:
        scenario: Of a team of two robots with a joint each.

    Raises:
        ScenarioError: The team is another.
    """
    length = _STEP * (len(CORRECTED) - 1)
    hall = box(-_BORDER, -_BORDER, length + _BORDER, _BORDER)
    names = list(scenario.start.joints)
    sizes = [len(values) for values in scenario.start.joints.values()]
    if sizes != [1] * (len(START) - 1):
        raise ScenarioError(str(scenario.path), "start.joints", sizes, "two robots with one joint each")
    joints: dict[str, tuple[float, ...]] = {
        name: (float(angle),) for name, angle in zip(names, START[1:], strict=True)
    }
    return replace(
        with_gains(scenario, scenario.selected_gains),
        workspace=Workspace(tuple((x, y) for x, y in hall.exterior.coords[:-1])),
        start=Start(ObjectPose(0.0, 0.0, float(START[0])), joints),
        goal=Goal(ObjectPose(length, 0.0, GOAL_ANGLE), {}, Tolerances(angle=ANGLE_TOLERANCE)),
    )


def corridor_plan(problem: PlanningProblem, gain_set: GainSet, name: str) -> Plan:
    """Return the thirty cells as a plan, which no search made; they are free because the hall is empty.

    Args:
        problem: Of :func:`corridor_scenario`.
        gain_set: Gains, fixed or to be scheduled.
        name: Name of the gain set.
    """
    boxes = []
    for index, row in enumerate(CORRECTED):
        x = _STEP * index
        polygon = box(x - _HALF, -_HALF, x + _HALF, _HALF)
        boxes.append(FreeBox(polygon, row[0::2].copy(), row[1::2].copy()))
    targets = [np.array([_STEP * index, 0.0]) for index in range(1, len(boxes))]
    channel = Channel(tuple(boxes), GOAL_ANGLE)
    return make_plan(
        problem, channel, gain_set, gain_set_name=name, targets=[*targets, problem.goal_pose[:2]]
    )
