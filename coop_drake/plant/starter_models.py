"""Writes the models of a new scenario: a box to carry, and a disc base with an arm of a few links."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

from coop_drake.drawing.colours import BASE_IN_MODELS, LINK_IN_MODELS, OBJECT_IN_MODELS

_LINK_WIDTH = 0.1
_LINK_HEIGHT = 0.08
"""Width and height of a link, as in the shipped models [m]."""
_ARM_HEIGHT = 0.4
"""Height of arms and grasps over the floor, as in the shipped models [m]."""
_BEND = 1.87
"""Limit of the joints on both sides, as in the shipped models [rad]."""
_JOINT_RATE = 2.0
"""Largest rate of the joints [rad/s]: that of usual arms on mobile bases."""


def object_model(length: float, width: float, mass: float = 1.0) -> str:
    """SDF of a box of a length along x, a width along y [m] and a mass [kg].

    Every side has a grasp frame in its middle, x outwards.
    """
    grasps = (
        (0.5 * length, 0.0, 0.0),
        (-0.5 * length, 0.0, pi),
        (0.0, 0.5 * width, pi / 2),
        (0.0, -0.5 * width, -pi / 2),
    )
    frames = "\n".join(
        f'    <frame name="grasp_{k}" attached_to="body"><pose>{x:.9g} {y:.9g} 0 0 0 {yaw!r}</pose></frame>'
        for k, (x, y, yaw) in enumerate(grasps)
    )
    pose, shape = f"0 0 {_ARM_HEIGHT} 0 0 0", _box(length, width, 0.2)
    body = _link("body", pose, "0 0 0", shape, mass, OBJECT_IN_MODELS)
    return _sdf("object", f"{body}\n{frames}", "The carried object, with a grasp frame on every side.")


def robot_model(name: str, links: Sequence[float], base_radius: float) -> str:
    """SDF of a holonomic disc base with straight links; the first link is rigid with the base.

    Args:
        name: Name of the model.
        links: Lengths from the base's centre to the end effector, with a revolute joint between each two [m].
        base_radius: Radius of the base [m].
    """
    disc = (
        f"<cylinder><radius>{base_radius:.9g}</radius><length>0.5</length></cylinder>",
        (base_radius**2 / 4 + 0.25 / 12, base_radius**2 / 4 + 0.25 / 12, base_radius**2 / 2),
    )
    parts = [_link("base", "0 0 0 0 0 0", "0 0 0.25", disc, 6.0, BASE_IN_MODELS)]
    for number, length in enumerate(links, start=1):
        frame = f'<pose relative_to="joint_{number}"/>'
        pose = f"0 0 {_ARM_HEIGHT} 0 0 0" if number == 1 else ""
        shape = _box(length, _LINK_WIDTH, _LINK_HEIGHT)
        link = _link(f"link_{number}", pose, f"{0.5 * length:.9g} 0 0", shape, 1.0, LINK_IN_MODELS)
        parts.append(link if number == 1 else link.replace("<pose></pose>", frame, 1))
        parts.append(_joint(number, links[number - 2] if number > 1 else 0.0))
    tip = f"{links[-1]:.9g} 0 0 0 0 {pi!r}"
    parts.append(f'    <frame name="gripper" attached_to="link_{len(links)}"><pose>{tip}</pose></frame>')
    return _sdf(name, "\n".join(parts), "A disc base and an arm; x of the gripper points back to the base.")


def _joint(number: int, before: float) -> str:
    if number == 1:
        return '    <joint name="mount" type="fixed"><parent>base</parent><child>link_1</child></joint>'
    return f"""    <joint name="joint_{number}" type="revolute">
      <pose relative_to="link_{number - 1}">{before:.9g} 0 0 0 0 0</pose>
      <parent>link_{number - 1}</parent>
      <child>link_{number}</child>
      <axis>
        <xyz>0 0 1</xyz>
        <limit><lower>{-_BEND}</lower><upper>{_BEND}</upper><velocity>{_JOINT_RATE}</velocity></limit>
      </axis>
    </joint>"""


Shape = tuple[str, tuple[float, float, float]]
"""Geometry as SDF, and its moments of inertia for a kilogramme [m^2]."""


def _box(length: float, width: float, height: float) -> Shape:
    moments = ((width**2 + height**2) / 12, (length**2 + height**2) / 12, (length**2 + width**2) / 12)
    return f"<box><size>{length:.9g} {width:.9g} {height:.9g}</size></box>", moments


def _link(name: str, pose: str, centre: str, shape: Shape, mass: float, colour: str) -> str:
    geometry, moments = shape
    xx, yy, zz = (f"{mass * moment:.9g}" for moment in moments)
    return f"""    <link name="{name}">
      <pose>{pose}</pose>
      <inertial>
        <pose>{centre} 0 0 0</pose>
        <mass>{mass:.9g}</mass>
        <inertia><ixx>{xx}</ixx><iyy>{yy}</iyy><izz>{zz}</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia>
      </inertial>
      <visual name="visual">
        <pose>{centre} 0 0 0</pose>
        <geometry>{geometry}</geometry>
        <material><diffuse>{colour}</diffuse></material>
      </visual>
      <collision name="collision">
        <pose>{centre} 0 0 0</pose>
        <geometry>{geometry}</geometry>
      </collision>
    </link>"""


def _sdf(name: str, content: str, comment: str) -> str:
    return f"""<?xml version="1.0"?>
<!-- {comment} -->
<sdf version="1.9">
  <model name="{name}">
{content}
  </model>
</sdf>
"""
