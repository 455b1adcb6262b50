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
_SLIDE_RATE = 0.5
"""Largest rate of sliding joints [m/s]: that of usual linear axes."""


def object_model(length: float, width: float, mass: float = 1.0, robots: int = 4) -> str:
    """SDF of a box of a length along x, a width along y [m] and a mass [kg].

    Grasp frames have x outwards. Up to four robots hold the middles of the sides; more of them hold the ends,
    and the long sides at quarters of the length.
    """
    off = 0.0 if robots <= 4 else 0.25 * length
    grasps = [(0.5 * length, 0.0, 0.0), (-0.5 * length, 0.0, pi)]
    for x in (off, -off) if off else (0.0,):
        grasps += [(x, 0.5 * width, pi / 2), (-x, -0.5 * width, -pi / 2)]
    return boxes_model(
        [(0.0, 0.0, length, width)], grasps, mass, "The carried object, with grasp frames on every side."
    )


def boxes_model(
    boxes: Sequence[tuple[float, float, float, float]],
    grasps: Sequence[tuple[float, float, float]],
    mass: float,
    comment: str,
) -> str:
    """SDF of an object made of boxes, with its centre of mass where its frame is.

    Args:
        boxes: Centre (x, y), length along x and width along y of each [m].
        grasps: Position (x, y) [m] and angle [rad] of each grasp frame, x outwards.
        mass: Mass [kg], spread evenly over the boxes' bounding box for the moments of inertia.
        comment: What the file says of itself.
    """
    frames = "\n".join(
        f'    <frame name="grasp_{k}" attached_to="body"><pose>{x:.9g} {y:.9g} 0 0 0 {yaw!r}</pose></frame>'
        for k, (x, y, yaw) in enumerate(grasps)
    )
    length, width = (
        max(box[k] + 0.5 * box[k + 2] for box in boxes) - min(box[k] - 0.5 * box[k + 2] for box in boxes)
        for k in (0, 1)
    )
    moments = _box(length, width, 0.2)[1]
    solids = [(f"{x:.9g} {y:.9g} 0", _box(a, b, 0.2)[0]) for x, y, a, b in boxes]
    pose = f"0 0 {_ARM_HEIGHT} 0 0 0"
    body = _link("body", pose, "0 0 0", solids, moments, mass, OBJECT_IN_MODELS)
    return _sdf("object", f"{body}\n{frames}", comment)


def robot_model(
    name: str, links: Sequence[float], base_radius: float, slides: Sequence[float | None] = ()
) -> str:
    """SDF of a holonomic disc base with straight links; the first link is rigid with the base.

    Args:
        name: Name of the model.
        links: Lengths from the base's centre to the end effector, with a joint between each two [m].
        base_radius: Radius of the base [m].
        slides: For each joint how far it draws the next link in if it is prismatic [m], None if it is
            revolute; empty if all are.
    """
    disc = (
        f"<cylinder><radius>{base_radius:.9g}</radius><length>0.5</length></cylinder>",
        (base_radius**2 / 4 + 0.25 / 12, base_radius**2 / 4 + 0.25 / 12, base_radius**2 / 2),
    )
    kinds = slides or (None,) * (len(links) - 1)
    base = [("0 0 0.25", disc[0])]
    parts = [_link("base", "0 0 0 0 0 0", "0 0 0.25", base, disc[1], 6.0, BASE_IN_MODELS)]
    for number, length in enumerate(links, start=1):
        frame = f'<pose relative_to="joint_{number}"/>'
        pose = f"0 0 {_ARM_HEIGHT} 0 0 0" if number == 1 else ""
        solid, moments = _box(length, _LINK_WIDTH, _LINK_HEIGHT)
        centre = f"{0.5 * length:.9g} 0 0"
        link = _link(f"link_{number}", pose, centre, [(centre, solid)], moments, 1.0, LINK_IN_MODELS)
        parts.append(link if number == 1 else link.replace("<pose></pose>", frame, 1))
        parts.append(_MOUNT if number == 1 else _joint(number, links[number - 2], kinds[number - 2]))
    tip = f"{links[-1]:.9g} 0 0 0 0 {pi!r}"
    parts.append(f'    <frame name="gripper" attached_to="link_{len(links)}"><pose>{tip}</pose></frame>')
    return _sdf(name, "\n".join(parts), "A disc base and an arm; x of the gripper points back to the base.")


_MOUNT = '    <joint name="mount" type="fixed"><parent>base</parent><child>link_1</child></joint>'


def _joint(number: int, before: float, slide: float | None) -> str:
    kind, axis, rate = (
        ("revolute", "0 0 1", _JOINT_RATE) if slide is None else ("prismatic", "1 0 0", _SLIDE_RATE)
    )
    lower, upper = (-_BEND, _BEND) if slide is None else (-slide, 0.0)
    return f"""    <joint name="joint_{number}" type="{kind}">
      <pose relative_to="link_{number - 1}">{before:.9g} 0 0 0 0 0</pose>
      <parent>link_{number - 1}</parent>
      <child>link_{number}</child>
      <axis>
        <xyz>{axis}</xyz>
        <limit><lower>{lower}</lower><upper>{upper}</upper><velocity>{rate}</velocity></limit>
      </axis>
    </joint>"""


Shape = tuple[str, tuple[float, float, float]]
"""Geometry as SDF, and its moments of inertia for a kilogramme [m^2]."""


def _box(length: float, width: float, height: float) -> Shape:
    moments = ((width**2 + height**2) / 12, (length**2 + height**2) / 12, (length**2 + width**2) / 12)
    return f"<box><size>{length:.9g} {width:.9g} {height:.9g}</size></box>", moments


def _link(
    name: str,
    pose: str,
    centre: str,
    solids: Sequence[tuple[str, str]],
    moments: tuple[float, float, float],
    mass: float,
    colour: str,
) -> str:
    shapes = "\n".join(_solid(*solid, str(k or ""), colour) for k, solid in enumerate(solids))
    xx, yy, zz = (f"{mass * moment:.9g}" for moment in moments)
    return f"""    <link name="{name}">
      <pose>{pose}</pose>
      <inertial>
        <pose>{centre} 0 0 0</pose>
        <mass>{mass:.9g}</mass>
        <inertia><ixx>{xx}</ixx><iyy>{yy}</iyy><izz>{zz}</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia>
      </inertial>
{shapes}
    </link>"""


def _solid(centre: str, geometry: str, suffix: str, colour: str) -> str:
    """A piece of a link's geometry, once to be seen and once to collide."""
    return f"""      <visual name="visual{suffix}">
        <pose>{centre} 0 0 0</pose>
        <geometry>{geometry}</geometry>
        <material><diffuse>{colour}</diffuse></material>
      </visual>
      <collision name="collision{suffix}">
        <pose>{centre} 0 0 0</pose>
        <geometry>{geometry}</geometry>
      </collision>"""


def _sdf(name: str, content: str, comment: str) -> str:
    return f"""<?xml version="1.0"?>
<!-- {comment} -->
<sdf version="1.9">
  <model name="{name}">
{content}
  </model>
</sdf>
"""
