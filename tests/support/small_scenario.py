"""Shipped teams moved into the open room of ``small_plan``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from shapely import Polygon

from coop_drake.scenario import Goal, ObjectPose, Scenario, Start, Tolerances, Workspace, load_scenario
from tests.support.scenarios import resting
from tests.support.small_plan import ANGLE_TOLERANCE, GOAL_POSE, POSITION_TOLERANCE, ROOM, START_POSE

MODELS = Path(__file__).parents[2] / "models"


def small_scenario(team: str = "base", workspace: Polygon = ROOM) -> Scenario:
    """The team of a shipped scenario (base, elbow, three) in the open room, or on another floor."""
    return in_open_room(resting(load_scenario(MODELS / f"{team}.scenario.yaml")), workspace)


def in_open_room(scenario: Scenario, workspace: Polygon = ROOM) -> Scenario:
    """The same team on another floor, with the start and the goal of ``small_plan``, joints at zero."""
    outer, *holes = (tuple(ring.coords)[:-1] for ring in (workspace.exterior, *workspace.interiors))
    return replace(
        scenario,
        workspace=Workspace(outer, tuple(holes)),
        start=Start(
            ObjectPose(*START_POSE),
            {name: tuple(0.0 for _ in values) for name, values in scenario.start.joints.items()},
        ),
        goal=Goal(ObjectPose(*GOAL_POSE), {}, Tolerances(position=POSITION_TOLERANCE, angle=ANGLE_TOLERANCE)),
        simulator=replace(scenario.simulator, max_time=30.0),
    )
