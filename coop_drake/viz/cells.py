"""The plan in the scene: cells and goal regions as flat shapes on the floor, one cell shown at a time."""

from __future__ import annotations

from pydrake.geometry import Meshcat
from shapely import Point
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.plan import Plan
from coop_drake.drawing.colours import BLUE, GREEN, OBJECT
from coop_drake.drawing.solids import flat_mesh, slab_mesh
from coop_drake.geometry.parts import component_at, parts_of
from coop_drake.viz.paint import rgba, set_mesh

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
