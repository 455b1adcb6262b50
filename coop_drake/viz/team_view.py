"""The team in the scene: its bodies as the models draw them, and its grasp points."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams, Rgba, Role, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.tree import BodyIndex, RigidBody
from pydrake.systems.framework import DiagramBuilder

from coop_drake.drawing.solids import TriangleMesh
from coop_drake.plant import TeamPlant, build_team_plant, set_configuration
from coop_drake.scenario import Scenario
from coop_drake.tree.pose import FloatArray
from coop_drake.viz.paint import set_mesh
from coop_drake.viz.team_colours import illustrations, paint_robots

_SEE_THROUGH = 0.6
"""Opacity of the object, below which its cell is to be seen."""

_GRASP = 0.07
"""Radius of the sphere at a grasp point [m]."""


class TeamView:
    """A team in Meshcat, in any configuration; it has a plant of its own, apart from the simulation's.

    Args:
        scenario: The scenario that describes the team.
        meshcat: Where it is drawn.

    Attributes:
        team: Its plant.
        colours: Of every robot; no two have the same one, up to five robots.
    """

    def __init__(self, scenario: Scenario, meshcat: Meshcat) -> None:
        self._meshcat = meshcat
        builder = DiagramBuilder()
        self.team: TeamPlant = build_team_plant(scenario, builder)
        self.colours = paint_robots(self.team)
        roles = [Role.kIllustration] + ([Role.kProximity] if scenario.visualization.show_collision else [])
        self._prefixes = [f"/team/{role.name[1:].lower()}" for role in roles]
        for role, prefix in zip(roles, self._prefixes, strict=True):
            parameters = MeshcatVisualizerParams(role=role, prefix=prefix)
            MeshcatVisualizer.AddToBuilder(builder, self.team.scene_graph, meshcat, parameters)
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._plant_context = self.team.plant.GetMyMutableContextFromRoot(self._context)
        self.show(np.zeros(3 + len(self.team.joint_names)))
        self._bodies = self._shown_bodies()
        self._set_grasps()

    def show(self, z: FloatArray) -> None:
        """Draw the team at z = (x, y, theta, q...), shape (3 + n,) [m, rad]."""
        set_configuration(self.team, self._plant_context, z)
        self._diagram.ForcedPublish(self._context)

    def poses(self, z: FloatArray) -> list[RigidTransform]:
        """Return the pose in W of the bodies of ``paths`` at z, shape (3 + n,)."""
        set_configuration(self.team, self._plant_context, z)
        return [body.EvalPoseInWorld(self._plant_context) for body, _ in self._bodies]

    @property
    def paths(self) -> list[list[str]]:
        """Paths in Meshcat of every body that is drawn."""
        return [paths for _, paths in self._bodies]

    def grasp_points(self, z: FloatArray) -> FloatArray:
        """Return the positions of the grasps in W at z, shape (N, 3) [m]."""
        set_configuration(self.team, self._plant_context, z)
        frames = [robot.gripper_frame for robot in self.team.robots]
        return np.array([frame.CalcPoseInWorld(self._plant_context).translation() for frame in frames])

    def fix_to_object(self, name: str, mesh: TriangleMesh, colour: Rgba) -> None:
        """Draw a mesh that moves with the object, its vertices in L."""
        set_configuration(self.team, self._plant_context, np.zeros(3 + len(self.team.joint_names)))
        X_WB = self.team.object_body.EvalPoseInWorld(self._plant_context)
        path = f"{self._object_path}/{name}"
        set_mesh(self._meshcat, path, mesh, colour)
        self._meshcat.SetTransform(path, X_WB.inverse())

    def object_heights(self) -> tuple[float, float]:
        """Return the heights of the object's lowest and highest point above the floor [m]."""
        set_configuration(self.team, self._plant_context, np.zeros(3 + len(self.team.joint_names)))
        X_WB, heights = self.team.object_body.EvalPoseInWorld(self._plant_context), []
        inspector = self.team.scene_graph.model_inspector()
        for geometry in illustrations(self.team, self.team.object_body):
            box = inspector.GetObbInGeometryFrame(geometry)
            if box is not None:
                X_WO = X_WB @ inspector.GetPoseInFrame(geometry) @ box.pose()
                middle, half = X_WO.translation()[2], np.abs(X_WO.rotation().matrix()[2]) @ box.half_width()
                heights += [float(middle - half), float(middle + half)]
        return (min(heights), max(heights)) if heights else (0.0, 0.0)

    @property
    def _object_path(self) -> str:
        return f"{self._prefixes[0]}/{_path_of(self.team.object_body.scoped_name().get_full())}"

    def _shown_bodies(self) -> list[tuple[RigidBody, list[str]]]:
        plant, has = self.team.plant, self._meshcat.HasPath
        shown = []
        for body in (plant.get_body(BodyIndex(index)) for index in range(plant.num_bodies())):
            name = _path_of(body.scoped_name().get_full())
            paths = [f"{prefix}/{name}" for prefix in self._prefixes if has(f"{prefix}/{name}")]
            if paths:
                shown.append((body, paths))
        return shown

    def _set_grasps(self) -> None:
        """Draw the grasps on the object's body, so that they move with it."""
        meshcat, body, inside = self._meshcat, self.team.object_body, self._plant_context
        path = self._object_path
        inspector = self.team.scene_graph.model_inspector()
        for geometry in illustrations(self.team, body):
            own = f"{path}/{_path_of(inspector.GetName(geometry))}"
            meshcat.SetProperty(own, "modulated_opacity", _SEE_THROUGH)
        for robot, colour in zip(self.team.robots, self.colours, strict=True):
            own = f"{path}/grasps/{robot.name}"
            meshcat.SetObject(own, Sphere(_GRASP), colour)
            meshcat.SetTransform(own, robot.gripper_frame.CalcPose(inside, body.body_frame()))


def _path_of(name: str) -> str:
    """Return the path at which Drake's visualizer draws a body of a scoped name."""
    return name.replace("::", "/")
