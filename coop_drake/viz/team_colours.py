"""Colours of the robots in the scene: those of their models, or of the figures where robots look alike."""

from __future__ import annotations

from pydrake.geometry import GeometryId, IllustrationProperties, Rgba, Role
from pydrake.multibody.tree import RigidBody

from coop_drake.drawing.colours import PAPER, blend, robot_colour
from coop_drake.plant import TeamPlant
from coop_drake.plant.parsing import bodies_of
from coop_drake.viz.paint import rgba

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
