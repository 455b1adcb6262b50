"""The scene of a transport in Meshcat: floor, walls, team, cells, trail and forces."""

from __future__ import annotations

from math import floor, log10, pi, radians

import numpy as np
import shapely
from pydrake.geometry import (
    Cylinder,
    GeometryId,
    IllustrationProperties,
    Meshcat,
    MeshcatCone,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    Role,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import BodyIndex, RigidBody
from pydrake.systems.framework import DiagramBuilder
from shapely import MultiLineString, Point, Polygon, box, minimum_rotated_rectangle, union_all
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.motion import OBJECT_ACCELERATION
from coop_drake.answers.plan import Plan
from coop_drake.drawing.colours import (
    BLUE,
    EDGE,
    FLOOR_IN_SPACE,
    GREEN,
    GRID,
    INK,
    OBJECT,
    PAPER,
    PILLAR,
    SHELF,
    WALL_IN_SPACE,
    blend,
    red_green_blue,
    robot_colour,
)
from coop_drake.drawing.solids import (
    TriangleMesh,
    camera_pose,
    flat_mesh,
    joined,
    ribbon_mesh,
    ring_lines,
    slab_mesh,
    team_footprints,
    wall_polygons,
)
from coop_drake.geometry.polygons import component_at, parts_of
from coop_drake.plant import TeamPlant, build_team_plant, read_component_tree, set_configuration
from coop_drake.plant.parsing import bodies_of
from coop_drake.scenario import Scenario
from coop_drake.tree.arrays import FloatArray

# Meshes and colours as Meshcat takes them.


def set_mesh(meshcat: Meshcat, path: str, mesh: TriangleMesh, colour: Rgba) -> None:
    """Put a triangle mesh at a path."""
    vertices, faces = (np.asfortranarray(rows.T) for rows in (mesh.vertices, mesh.faces))
    meshcat.SetTriangleMesh(path, vertices, faces, colour)


def rgba(colour: str, opacity: float = 1.0) -> Rgba:
    """Return a colour ``#rrggbb`` as Drake takes it."""
    return Rgba(*(part / 255 for part in red_green_blue(colour)), opacity)


def hex_colour(colour: Rgba) -> str:
    """Return a colour of Drake as ``#rrggbb``."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in (colour.r(), colour.g(), colour.b()))


# Arrows in the scene: the force of every robot's end effector on the object, at its grasp.

LONGEST = 1.2
"""Greatest length of an arrow [m]; stronger forces are drawn with it."""

ABOVE = np.array([0.0, 0.0, 0.15])
"""From a grasp to its arrow, which would otherwise lie inside the arm [m]."""

_SHORTEST = 1e-3
"""Least length of an arrow [m]: one of length zero cannot be scaled."""

_VISIBLE = 0.03
"""Length below which an arrow is too small to show a direction [m]."""

_FULL_WIDTH = 0.3
"""Length below which an arrow is drawn thinner [m]."""

_HEAD = 0.3
"""Length of the head relative to that of the arrow."""

_GRAVITY = 9.81
"""Acceleration of free fall [m/s^2]."""


def force_of_a_metre(team: TeamPlant, acceleration: float) -> float:
    """Return the force of an arrow of one metre [N]: about a robot's share for an acceleration [m/s^2]."""
    force = team.object_inertia.mass * acceleration / len(team.robots)
    decade = 10.0 ** floor(log10(force))
    return next(step * decade for step in (1.0, 2.0, 5.0, 10.0) if step * decade >= force)


def set_arrows(meshcat: Meshcat, colours: list[Rgba]) -> None:
    """Make an arrow along x for every robot, nearly of length zero, to be turned and stretched."""
    along_x, back = RotationMatrix.MakeYRotation(pi / 2), RotationMatrix.MakeYRotation(-pi / 2)
    middle, tip = np.array([0.5 * (1.0 - _HEAD), 0.0, 0.0]), np.array([1.0, 0.0, 0.0])
    for index, colour in enumerate(colours):
        shaft, head = (f"{arrow_path(index)}/{part}" for part in ("shaft", "head"))
        meshcat.SetObject(shaft, Cylinder(0.03, 1.0 - _HEAD), colour)
        meshcat.SetTransform(shaft, RigidTransform(along_x, middle))
        # The tip of a cone in Meshcat is the origin of its frame.
        meshcat.SetObject(head, MeshcatCone(_HEAD, 0.09, 0.09), colour)
        meshcat.SetTransform(head, RigidTransform(back, tip))
        meshcat.SetProperty(arrow_path(index), "scale", [_SHORTEST] * 3)


def arrow_path(index: int) -> str:
    """Return the path of a robot's arrow."""
    return f"/forces/robot_{index}"


def arrow_sizes(forces: FloatArray, of_a_metre: float) -> tuple[FloatArray, FloatArray]:
    """Return how to draw forces in W, shape (F, 2) [N], if a metre stands for some force [N].

    Returns:
        Directions, unwrapped, shape (F,) [rad], and scales of the arrow along its axes, shape (F, 3).
    """
    lengths = np.clip(np.linalg.norm(forces, axis=1) / of_a_metre, _SHORTEST, LONGEST)
    widths = np.minimum(1.0, lengths / _FULL_WIDTH)
    # Where a force is too small to be seen, the arrow keeps the direction it had.
    last_seen = np.maximum.accumulate(np.where(lengths > _VISIBLE, np.arange(len(forces)), 0))
    directions = np.unwrap(np.arctan2(forces[last_seen, 1], forces[last_seen, 0]))
    return directions, np.column_stack([lengths, widths, widths])


# The plan in the scene: cells and goal regions as flat shapes on the floor, one cell shown at a time.

CELL_COLOUR, GOAL_COLOUR, GOAL_POSE_COLOUR = BLUE, GREEN, OBJECT

_LINE = 0.03
"""Width of outlines [m]."""

_OUTLINE_TOLERANCE = 0.003
"""Distance by which outlines may move when they are simplified [m]: the page stays small."""

_FRAME_OPACITY = 0.6
"""Opacity of the goal's frame: the object and the bodies behind are to be seen through it."""

_TARGET = 0.05
"""Radius of the dot at a cell's target [m]."""


def set_cells(meshcat: Meshcat, plan: Plan) -> None:
    """Draw every cell, its goal region and its target.

    Only those of the first cell are visible at first; the animation switches them.
    """
    for index, (cell, transition) in enumerate(zip(plan.cells, plan.transitions, strict=True)):
        of_cell, of_goal = cell_paths(index)
        _set_area(meshcat, of_cell, cell.tidied, 0.004, CELL_COLOUR)
        _set_area(meshcat, of_goal, _goal_region(plan, index), 0.012, GOAL_COLOUR)
        target = Point(transition.target).buffer(_TARGET, quad_segs=4)
        _set_flat(meshcat, f"{of_goal}/target", target, 0.020, GOAL_COLOUR, 1.0)
        for line in (f"{of_cell}/outline", f"{of_goal}/outline", f"{of_goal}/target"):
            _show_through_bodies(meshcat, line)
        for path in (of_cell, of_goal):
            meshcat.SetProperty(path, "visible", index == 0)


def set_goal(meshcat: Meshcat, footprint: BaseGeometry, bottom: float, top: float) -> None:
    """Draw where the object is to stand in the end: its outline on the floor, and a frame that it fits into.

    The frame is as high above the floor as the object, from ``bottom`` to ``top`` [m].
    """
    _set_area(meshcat, "/plan/goal_pose", footprint, 0.026, GOAL_POSE_COLOUR)
    frame = parts_of(footprint.buffer(_LINE, join_style="mitre").difference(footprint))
    set_mesh(
        meshcat,
        "/plan/goal_pose/frame",
        slab_mesh(frame, bottom, top),
        rgba(GOAL_POSE_COLOUR, _FRAME_OPACITY),
    )


def cell_paths(index: int) -> tuple[str, str]:
    """Return the paths of a cell and of its goal region."""
    return f"/plan/cells/{index:03d}", f"/plan/goal_regions/{index:03d}"


def _goal_region(plan: Plan, index: int) -> BaseGeometry:
    """What a cell and the next one share around the target; in the last cell the disc about the goal."""
    target = Point(plan.transitions[index].target)
    if index + 1 == len(plan.cells):
        return target.buffer(plan.transitions[index].inradius)
    return component_at(plan.cells[index].tidied & plan.cells[index + 1].tidied, target)


def _set_area(meshcat: Meshcat, path: str, shape: BaseGeometry, height: float, colour: str) -> None:
    """Draw an area with an outline inside of it, so that both together are as large as the area."""
    shape = shape.simplify(_OUTLINE_TOLERANCE)
    outline = shape.difference(shape.buffer(-_LINE, join_style="mitre")).simplify(_OUTLINE_TOLERANCE)
    _set_flat(meshcat, f"{path}/area", shape, height, colour, 0.22)
    _set_flat(meshcat, f"{path}/outline", outline, height + 0.003, colour, 0.9)


def _show_through_bodies(meshcat: Meshcat, path: str) -> None:
    """Draw a mesh after all others and over them: many cells are smaller than the object above them."""
    meshcat.SetProperty(f"{path}/<object>", "material.depthTest", False)
    meshcat.SetProperty(f"{path}/<object>", "renderOrder", 1.0)


def _set_flat(
    meshcat: Meshcat, path: str, shape: BaseGeometry, height: float, colour: str, opacity: float
) -> None:
    parts = parts_of(shape)
    if parts:
        set_mesh(meshcat, path, flat_mesh(parts, height), rgba(colour, opacity))


# The object's trail: a ribbon on the floor that grows as the object moves.

TRAIL_COLOUR = INK

STEP = 0.03
"""Length of the pieces of a trail [m]."""

INDICES = 6
"""Number of indices of vertices in the mesh of a piece: two triangles."""

_WIDTH, _HEIGHT = 0.035, 0.030
"""Width of the ribbon and its height above the floor [m]."""


def set_trail(meshcat: Meshcat, path: str, points: FloatArray) -> None:
    """Draw a part of the trail through points of shape (P, 2) [m]; fewer than two draw nothing."""
    if len(points) > 1:
        set_mesh(meshcat, path, ribbon_mesh(points, _WIDTH, _HEIGHT), rgba(TRAIL_COLOUR))


def trail_points(positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points at even distances along a path of the object, given at every frame, shape (F, 2) [m].

    Returns:
        The points, shape (P, 2) [m], and how many segments between them the object has passed at every frame,
        with fractions, shape (F,).
    """
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    pieces = int(np.ceil(gone[-1] / STEP))
    marks = np.linspace(0.0, gone[-1], pieces + 1)
    moving = np.concatenate([[True], np.diff(gone) > 0.0])
    points = np.column_stack([np.interp(marks, gone[moving], column[moving]) for column in positions.T])
    return points, gone / max(gone[-1], 1e-12) * pieces


# Colours of the robots in the scene: those of their models, or of the figures where robots look alike.

_LIGHTER = 0.45
"""How much lighter than its base a robot's arm is painted, 0 to 1: arm and base are told apart."""

_GREY = 0.1
"""Largest difference between the components of a colour that counts as grey: wheels and chassis keep it."""


def paint_robots(team: TeamPlant) -> list[Rgba]:
    """Return every robot's colour: that of its base in the model.

    Where two robots have the same one, all are painted in the colours that they have in figures. To be called
    before a context of the plant's diagram is made.
    """
    colours = [
        _first_colour(team, robot.base_body) or rgba(robot_colour(index))
        for index, robot in enumerate(team.robots)
    ]
    if len({(one.r(), one.g(), one.b()) for one in colours}) == len(colours):
        return colours
    for index, robot in enumerate(team.robots):
        for body in bodies_of(team.plant, team.assembly.robots[index].models):
            lighter = 0.0 if body.index() == robot.base_body.index() else _LIGHTER
            _paint(team, body, rgba(blend(robot_colour(index), PAPER, lighter)))
    return [rgba(robot_colour(index)) for index in range(len(colours))]


def illustrations(team: TeamPlant, body: RigidBody) -> list[GeometryId]:
    """Return the visible geometries of a body, in the order of its model."""
    frame = team.plant.GetBodyFrameIdOrThrow(body.index())
    ids = team.scene_graph.model_inspector().GetGeometries(frame, Role.kIllustration)
    return sorted(ids, key=lambda one: one.get_value())


def _first_colour(team: TeamPlant, body: RigidBody) -> Rgba | None:
    known = (_colour_of(team, geometry) for geometry in illustrations(team, body))
    return next((Rgba(one.r(), one.g(), one.b(), 1.0) for one in known if one is not None), None)


def _colour_of(team: TeamPlant, geometry: GeometryId) -> Rgba | None:
    properties = team.scene_graph.model_inspector().GetIllustrationProperties(geometry)
    if properties is None or not properties.HasProperty("phong", "diffuse"):
        return None
    colour: Rgba = properties.GetProperty("phong", "diffuse")
    return colour


def _paint(team: TeamPlant, body: RigidBody, colour: Rgba) -> None:
    """Paint the visible geometries of a body, except grey parts of a body that has others."""
    geometries = illustrations(team, body)
    coloured = [geometry for geometry in geometries if not _is_grey(_colour_of(team, geometry))]
    for geometry in coloured or geometries:
        known = team.scene_graph.model_inspector().GetIllustrationProperties(geometry)
        properties = IllustrationProperties(known)
        properties.UpdateProperty("phong", "diffuse", colour)
        source = team.plant.get_source_id()
        team.scene_graph.RemoveRole(source, geometry, Role.kIllustration)
        team.scene_graph.AssignRole(source, geometry, properties)


def _is_grey(colour: Rgba | None) -> bool:
    if colour is None:
        return False
    parts = (colour.r(), colour.g(), colour.b())
    return max(parts) - min(parts) <= _GREY


# The team in the scene: its bodies as the models draw them, and its grasp points.

_SEE_THROUGH = 0.6
"""Opacity of the object; its cell shows through it."""

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


# What stands still in the scene: floor with a metre grid, walls, shelves, light and camera.

_WALL_OPACITY = 0.42
"""Opacity of walls, behind which robots are to be seen."""

_OBSTACLE_OPACITY = 0.85
"""Opacity of pillars and shelves."""

_WALL_THICKNESS = 0.08
"""Thickness of walls around the floor [m]."""

_SHELF_LENGTH = 0.8
"""Length from which on a convex obstacle on the floor is drawn as shelves, else as a pillar [m]."""

_CONVEX = 0.99
"""Part of its convex hull from which on an obstacle counts as convex; others are walls inside the floor."""

_BOARDS = (0.12, 0.55, 1.0)
"""Tops of a shelf's boards, relative to the height of walls."""

_BOARD, _POST = 0.02, 0.025
"""Thickness of a shelf's boards, half the width of its posts [m]."""

FIELD_OF_VIEW = 30.0
"""Of the camera, from bottom to top [degrees]: narrow, so that walls look upright."""

_ELEVATION = radians(56.0)
"""How steeply the camera looks down [rad]: bodies behind walls are seen over them."""

FILL = 0.95
"""Part of the picture that the floor fills; headline and player lie outside of the picture."""

_LIGHTS = {"AmbientLight": 2.7, "FillLight": 1.6, "PointLightNegativeX": 0.0, "PointLightPositiveX": 0.0}
"""Intensities of Meshcat's lights: from everywhere alike, so that the floor has no shadows."""

_SKY, _HORIZON = [1.0, 1.0, 1.0], [0.90, 0.92, 0.95]
"""Red, green and blue of the background at its top and at its bottom."""


def place_camera(meshcat: Meshcat, workspace: Polygon, height: float) -> None:
    """Look at the whole workspace from above at an angle, in a narrow field of view."""
    position, target = camera_pose(
        workspace, height, elevation=_ELEVATION, fill=FILL, field_of_view=radians(FIELD_OF_VIEW)
    )
    distance = float(np.linalg.norm(position - target))
    camera = Meshcat.PerspectiveCamera(fov=FIELD_OF_VIEW, near=0.01 * distance, far=10.0 * distance)
    meshcat.SetCamera(camera)
    meshcat.SetCameraPose(position, target)


def floor_corners(workspace: Polygon, height: float) -> list[list[float]]:
    """Return corners [m] of a prism that holds the floor and all that stands on it up to a height [m]."""
    outline = shapely.get_coordinates(workspace.convex_hull)[:-1].tolist()
    return [[x, y, z] for x, y in outline for z in (0.0, height)]


def set_stage(meshcat: Meshcat, workspace: Polygon, wall_height: float) -> None:
    """Light the floor and put up what stands still on it, translucent where bodies may be behind.

    Walls and shelves are ``wall_height`` high [m].
    """
    _set_light(meshcat)
    set_mesh(meshcat, "/stage/floor", flat_mesh(parts_of(workspace), 0.0), rgba(FLOOR_IN_SPACE))
    meshcat.SetLineSegments("/stage/grid", *_grid(workspace, 0.002), 1.0, rgba(GRID))
    holes = [Polygon(ring) for ring in workspace.interiors]
    inside = [hole for hole in holes if hole.area < _CONVEX * hole.convex_hull.area]
    walls = wall_polygons(Polygon(workspace.exterior), _WALL_THICKNESS) + inside
    wall = rgba(WALL_IN_SPACE, _WALL_OPACITY)
    set_mesh(meshcat, "/stage/walls", slab_mesh(walls, 0.0, wall_height), wall)
    for index, hole in enumerate(hole for hole in holes if hole not in inside):
        if _length(hole) < _SHELF_LENGTH:
            path, mesh, colour = f"/stage/pillars/{index:02d}", slab_mesh([hole], 0.0, wall_height), PILLAR
        else:
            path, mesh, colour = f"/stage/shelves/{index:02d}", _shelf(hole, wall_height), SHELF
        set_mesh(meshcat, path, mesh, rgba(colour, _OBSTACLE_OPACITY))
    for name, height in (("foot", 0.005), ("top", wall_height)):
        meshcat.SetLineSegments(f"/stage/edges/{name}", *ring_lines([workspace], height), 2.0, rgba(EDGE))


def _set_light(meshcat: Meshcat) -> None:
    """Light the whole floor evenly, on white, without Meshcat's own grid and axes."""
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    for name, colour in (("top_color", _SKY), ("bottom_color", _HORIZON)):
        meshcat.SetProperty("/Background/<object>", name, colour)
    for name, intensity in _LIGHTS.items():
        meshcat.SetProperty(f"/Lights/{name}/<object>", "intensity", intensity)


def _grid(workspace: Polygon, height: float) -> tuple[FloatArray, FloatArray]:
    """Return both ends of lines a metre apart on the floor, each of shape (3, m) [m]."""
    x_min, y_min, x_max, y_max = workspace.bounds
    upright = [[(x, y_min), (x, y_max)] for x in np.arange(np.ceil(x_min), x_max)]
    level = [[(x_min, y), (x_max, y)] for y in np.arange(np.ceil(y_min), y_max)]
    on_floor = MultiLineString(upright + level).intersection(workspace)
    lines = [part for part in getattr(on_floor, "geoms", [on_floor]) if part.length > 0.0]
    ends = np.array([[line.coords[0], line.coords[-1]] for line in lines]).reshape(-1, 2, 2)
    raised = np.concatenate([ends, np.full((len(ends), 2, 1), height)], axis=2)
    return np.asfortranarray(raised[:, 0].T), np.asfortranarray(raised[:, 1].T)


def _length(shape: Polygon) -> float:
    """Return the length of the longer side of the smallest rectangle round a shape [m]."""
    corners = shapely.get_coordinates(minimum_rotated_rectangle(shape))
    return float(np.linalg.norm(np.diff(corners, axis=0), axis=1).max())


def _shelf(shape: Polygon, height: float) -> TriangleMesh:
    """Return boards of the obstacle's own outline, with a post at every corner."""
    corners = np.asarray(shape.exterior.coords)[:-1, :2]
    posts = [box(x - _POST, y - _POST, x + _POST, y + _POST) for x, y in corners]
    inside = [part for post in posts for part in parts_of(post & shape)]
    boards = [slab_mesh([shape], part * height - _BOARD, part * height) for part in _BOARDS]
    return joined([slab_mesh(inside, 0.0, height), *boards])


# The scene of a transport in Meshcat, for recordings and live views: floor, plan, team and arrows.

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
        acceleration = _GRAVITY if plan.motion is None else OBJECT_ACCELERATION
        self.of_a_metre = force_of_a_metre(self.team.team, acceleration)
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
