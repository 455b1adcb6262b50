"""Small scenario files that plan and run in seconds, written next to each other in a temporary folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import yaml

from coop_drake.scenario import Scenario, with_gains
from coop_drake.scenario.model import RobotLimits

ROOT = Path(__file__).parents[2]
MODELS = ROOT / "models"

ROOM = {
    "workspace": {"outer": [[0, 0], [6, 0], [6, 4], [0, 4]]},
    "directives": [
        {"add_model": {"name": "object", "file": "package://coop_drake_models/object.sdf"}},
        {"add_model": {"name": "robot_0", "file": "package://coop_drake_models/long_blue.sdf"}},
        {"add_model": {"name": "robot_1", "file": "package://coop_drake_models/long_orange.sdf"}},
        {"add_weld": {"parent": "object::grasp_0", "child": "robot_0::gripper"}},
        {"add_weld": {"parent": "object::grasp_1", "child": "robot_1::gripper"}},
    ],
    "start": {"object": {"x": 2.5, "y": 2.0, "theta": 0.0}, "joints": {"robot_0": [0.0], "robot_1": [0.0]}},
    "goal": {"object": {"x": 3.2, "y": 2.2, "theta": 0.1}},
}

TWO_ROOMS = {
    "workspace": {
        "outer": [[0, 0], [5, 0], [5, 1.1], [5.4, 1.1], [5.4, 0], [10, 0],
                  [10, 4], [5.4, 4], [5.4, 2.9], [5, 2.9], [5, 4], [0, 4]],
    },
    "start": {"object": {"x": 2.5, "y": 2.0, "theta": 1.0}, "joints": {"robot_0": [0.0], "robot_1": [0.0]}},
    "goal": {"object": {"x": 7.5, "y": 2.0, "theta": 1.5}},
}  # fmt: skip
"""Sections with a door through which the team goes without turning: it turns before and behind it."""


def resting(scenario: Scenario) -> Scenario:
    """The scenario of a team that rests in every cell, with limits of bases that it hardly reaches."""
    limits = scenario.limits or {"*": RobotLimits(7.0, 8.0)}
    return with_gains(replace(scenario, limits=limits), "scheduled")


def write_scenario(path: Path, **sections: object) -> Path:
    """Write a scenario in which two robots move the object a little way in an empty room.

    Args:
        path: The file.
        sections: Whole sections that replace or add to the room's.
    """
    path.write_text(yaml.safe_dump({**ROOM, **sections}))
    return path
