"""The scene of a transport in Meshcat: stage, plan, team and arrows, as recordings and live views show it."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat
from shapely import union_all

from coop_drake.drawing.footprints import team_footprints
from coop_drake.planning.plan import Plan
from coop_drake.plant import read_component_tree
from coop_drake.scenario import Scenario
from coop_drake.viz.arrows import force_of_a_metre, set_arrows
from coop_drake.viz.cells import set_cells, set_goal
from coop_drake.viz.stage import place_camera, set_stage
from coop_drake.viz.team_view import TeamView

__all__ = ["TransportScene"]


class TransportScene:
    """Everything that a transport shows, put up in a Meshcat, the team at the plan's start.

    Args:
        scenario: Floor and team.
        plan: Its cells.
        meshcat: Where to draw.

    Attributes:
        meshcat: Where it stands.
        team: The team in it.
        of_a_metre: The force that an arrow of a metre stands for [N].
    """

    def __init__(self, scenario: Scenario, plan: Plan, meshcat: Meshcat) -> None:
        self.meshcat = meshcat
        self._floor, self._height = scenario.workspace.polygon, scenario.visualization.wall_height
        set_stage(meshcat, self._floor, self._height)
        set_cells(meshcat, plan)
        self.team = TeamView(scenario, meshcat)
        self.of_a_metre = force_of_a_metre(self.team.team)
        set_arrows(meshcat, self.team.colours)
        at_goal = np.concatenate([plan.goal_pose, plan.start[3:]])
        footprints = team_footprints(read_component_tree(self.team.team), at_goal)
        set_goal(meshcat, union_all([one.shape for one in footprints if one.robot is None]))
        self.team.show(plan.start)

    def place_camera(self) -> None:
        """Look at the whole floor."""
        place_camera(self.meshcat, self._floor, self._height)
