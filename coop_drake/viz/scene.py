"""The scene of a transport in Meshcat, for recordings and live views: floor, plan, team and arrows."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat
from shapely import union_all
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.plan import Plan
from coop_drake.drawing.colours import INK
from coop_drake.drawing.footprints import team_footprints
from coop_drake.drawing.solids import flat_mesh
from coop_drake.geometry.parts import parts_of
from coop_drake.plant import read_component_tree
from coop_drake.scenario import Scenario
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.arrows import force_of_a_metre, set_arrows
from coop_drake.viz.cells import set_cells, set_goal
from coop_drake.viz.paint import rgba
from coop_drake.viz.stage import place_camera, set_stage
from coop_drake.viz.team_view import TeamView

_SHADOW_HEIGHT = 0.003
"""Height of the object's shadow [m]: above the grid, below the cells, which it would otherwise darken."""


class TransportScene:
    """All that recordings and live views of a transport show, with the team at the plan's start.

    Attributes:
        meshcat: Where it is drawn.
        team: The team.
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
        set_goal(meshcat, self._footprint(plan.goal_pose), *self.team.object_heights())
        shadow = flat_mesh(parts_of(self._footprint(np.zeros(3))), _SHADOW_HEIGHT)
        self.team.fix_to_object("shadow", shadow, rgba(INK, 0.3))
        self.team.show(plan.start)

    def _footprint(self, pose: FloatArray) -> BaseGeometry:
        """Return the object's footprint at a pose (x, y, theta), shape (3,) [m, rad]."""
        z = np.concatenate([pose, np.zeros(len(self.team.team.joint_names))])
        footprints = team_footprints(read_component_tree(self.team.team), z)
        return union_all([footprint.shape for footprint in footprints if footprint.robot is None])

    def place_camera(self) -> None:
        """Look at the whole floor."""
        place_camera(self.meshcat, self._floor, self._height)
