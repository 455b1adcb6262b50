"""Models that are written: polygonal bodies, boxes to carry, and robots to start from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from shapely import Polygon, constrained_delaunay_triangles

from coop_drake.drawing.colours import BASE_IN_MODELS, LINK_IN_MODELS, OBJECT_IN_MODELS
from coop_drake.errors import GeometryError
from coop_drake.files import write_atomically
from coop_drake.tree.arrays import FloatArray

# Bodies that are polygons, in convex parts.

Ring = list[tuple[float, float]]

_STRAIGHT = 1e-12
"""Cross product of two edges up to which a corner counts as straight [m^2]."""


def convex_parts(outline: Polygon) -> list[Polygon]:
    """Triangulate a valid polygon and merge neighbouring parts while they stay convex.

    The corners of the parts are corners of the outline, so their union is exact. The parts are
    counter-clockwise, in an order that depends on the outline alone.
    """
    triangles = constrained_delaunay_triangles(outline).geoms
    rings = sorted(_ring(t) for t in triangles if isinstance(t, Polygon) and t.area > 0.0)
    joined = True
    while joined:
        joined = False
        for first in range(len(rings)):
            for second in range(first + 1, len(rings)):
                merged = _merge(rings[first], rings[second])
                if merged is not None:
                    rings[first] = merged
                    del rings[second]
                    joined = True
                    break
            if joined:
                break
    return [Polygon(ring) for ring in rings]


def _ring(polygon: Polygon) -> Ring:
    """Counter-clockwise corners, the smallest (x, y) first."""
    corners = [(float(x), float(y)) for x, y in polygon.exterior.coords[:-1]]
    if not polygon.exterior.is_ccw:
        corners.reverse()
    start = corners.index(min(corners))
    return corners[start:] + corners[:start]


def _merge(first: Ring, second: Ring) -> Ring | None:
    """Merge two rings along a common edge; None if they have none or the result is not convex."""
    for index, start in enumerate(first):
        end = first[(index + 1) % len(first)]
        if end not in second:
            continue
        other = second.index(end)
        if second[(other + 1) % len(second)] == start:
            around = [second[(other + 1 + step) % len(second)] for step in range(len(second))]
            merged = first[: index + 1] + around[1:-1] + first[index + 1 :]
            return merged if _is_convex(np.array(merged)) else None
    return None


def _is_convex(ring: FloatArray) -> bool:
    edges = np.roll(ring, -1, axis=0) - ring
    following = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    return bool((turns >= -_STRAIGHT).all())


# Writes models of polygonal bodies, convex or not.


Point = Sequence[float]


@dataclass(frozen=True)
class PlanarMass:
    """Exact mass properties of an upright prism of uniform density.

    Attributes:
        mass: Mass [kg].
        centroid: Centre of mass in the plane, shape (2,) [m].
        inertia: About the centre of mass, shape (3, 3) [kg m^2].
    """

    mass: float
    centroid: FloatArray
    inertia: FloatArray


def planar_mass(
    vertices: Sequence[Point], mass: float, height: float, inertia: float | None = None
) -> PlanarMass:
    """Compute the mass properties of a polygonal prism.

    Args:
        vertices: Corners, shape (n, 2) [m].
        mass: Mass [kg].
        height: Height of the prism [m].
        inertia: If given, the whole inertia is scaled so that this is the part about the vertical [kg m^2].
    """
    corners = np.asarray(vertices, dtype=float)
    corners = corners - (origin := corners.mean(axis=0))
    following = np.roll(corners, -1, axis=0)
    (x, y), (u, v) = corners.T, following.T
    cross = x * v - u * y
    area = 0.5 * cross.sum()
    centroid = np.array([((x + u) * cross).sum(), ((y + v) * cross).sum()]) / (6.0 * area)
    xx = ((x * x + x * u + u * u) * cross).sum() / (12.0 * area) - centroid[0] ** 2
    yy = ((y * y + y * v + v * v) * cross).sum() / (12.0 * area) - centroid[1] ** 2
    xy = ((x * v + 2.0 * x * y + 2.0 * u * v + u * y) * cross).sum() / (24.0 * area) - centroid.prod()
    upright = height**2 / 12.0
    moments = mass * np.array([[yy + upright, -xy, 0.0], [-xy, xx + upright, 0.0], [0.0, 0.0, xx + yy]])
    if inertia is not None:
        moments *= inertia / moments[2, 2]
    return PlanarMass(mass, centroid + origin, moments)


def polygon_body_files(
    vertices: Sequence[Point],
    mass: float,
    name: str,
    height: float = 0.2,
    *,
    inertia: float | None = None,
    elevation: float = 0.4,
    grasps: Sequence[Point] = (),
) -> dict[str, str]:
    """Write the model of a polygonal body as text: one SDF file, and one mesh for each convex part.

    Args:
        vertices: Corners of the outline in the body's frame, in either sense of rotation, shape (n, 2) [m].
        mass: Mass [kg].
        name: Name of the model; the files are named after it.
        height: Height [m].
        inertia: Inertia about the vertical through the centre of mass [kg m^2]; uniform density if None.
        elevation: Height of the body's middle over the floor, the shipped robots' grasp height [m].
        grasps: Grasp frames, each (x, y, facing) [m, rad]; they are named ``grasp_0``, ``grasp_1``, ...

    Returns:
        File names with their contents, ``name.sdf`` first.

    Raises:
        GeometryError: The outline crosses itself or has no area, or a number is not positive.
    """
    outline = _checked(vertices, {"mass": mass, "height": height, "inertia": inertia})
    corners = np.array(outline.exterior.coords)[:-1]
    parts = [np.array(part.exterior.coords)[:-1] for part in convex_parts(outline)]
    meshes = {f"{name}_part_{index}.obj": _prism(part, height) for index, part in enumerate(parts)}
    properties = planar_mass(corners.tolist(), mass, height, inertia)
    sdf = _model(name, properties, list(meshes), elevation, grasps)
    return {f"{name}.sdf": sdf, **meshes}


def write_polygon_body(files: dict[str, str], directory: Path) -> Path:
    """Write the files of :func:`polygon_body_files` into a directory; returns the SDF file's path."""
    directory.mkdir(parents=True, exist_ok=True)
    for file, text in reversed(files.items()):
        write_atomically(directory / file, text.encode())
    return directory / next(iter(files))


def _checked(vertices: Sequence[Point], numbers: dict[str, float | None]) -> Polygon:
    for label, value in numbers.items():
        if value is not None and not (np.isfinite(value) and value > 0.0):
            raise GeometryError(f"{label} must be a positive number, got {value!r}")
    corners = np.asarray(vertices, dtype=float)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3 or not np.isfinite(corners).all():
        raise GeometryError("an outline needs three or more corners, each (x, y)")
    outline = Polygon(corners)
    if not outline.is_valid or outline.area <= 0.0:
        raise GeometryError("the outline crosses or touches itself, or has no area")
    return outline if outline.exterior.is_ccw else Polygon(corners[::-1])


def _prism(corners: FloatArray, height: float) -> str:
    """A convex prism as Wavefront OBJ text, its middle at z = 0."""
    count = len(corners)
    lines = [
        f"v {x:.12g} {y:.12g} {z:.12g}" for z in (-0.5 * height, 0.5 * height) for x, y in corners.tolist()
    ]
    lines.append("f " + " ".join(str(index) for index in range(count, 0, -1)))
    lines.append("f " + " ".join(str(count + index) for index in range(1, count + 1)))
    for index in range(count):
        following = (index + 1) % count
        lines.append(f"f {index + 1} {following + 1} {count + following + 1} {count + index + 1}")
    return "\n".join(lines) + "\n"


def _model(
    name: str, properties: PlanarMass, meshes: list[str], elevation: float, grasps: Sequence[Point]
) -> str:
    (ixx, ixy, _), (_, iyy, _), (_, _, izz) = properties.inertia.tolist()
    x, y = properties.centroid.tolist()
    inertial = _inertial(f"{x:.16g} {y:.16g} 0", properties.mass, (ixx, iyy, izz, ixy), digits=16)
    solids = [("0 0 0", f"<mesh><uri>{mesh}</uri><drake:declare_convex/></mesh>") for mesh in meshes]
    body = _link("body", f"0 0 {elevation:.12g} 0 0 0", inertial, solids, OBJECT_IN_MODELS)
    return _sdf(name, "\n".join([body, *_grasp_frames(grasps, 12)]), "A polygonal body in convex parts.")


# Writes the models of a new scenario: a box to carry, and a disc base with an arm of a few links.

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
    length, width = (
        max(box[k] + 0.5 * box[k + 2] for box in boxes) - min(box[k] - 0.5 * box[k + 2] for box in boxes)
        for k in (0, 1)
    )
    moments = _box(length, width, 0.2)[1]
    solids = [(f"{x:.9g} {y:.9g} 0", _box(a, b, 0.2)[0]) for x, y, a, b in boxes]
    pose, inertial = f"0 0 {_ARM_HEIGHT} 0 0 0", _inertial("0 0 0", mass, [mass * one for one in moments])
    body = _link("body", pose, inertial, solids, OBJECT_IN_MODELS)
    return _sdf("object", "\n".join([body, *_grasp_frames(grasps)]), comment)


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
    inertial = _inertial("0 0 0.25", 6.0, [6.0 * one for one in disc[1]])
    parts = [_link("base", "0 0 0 0 0 0", inertial, base, BASE_IN_MODELS)]
    for number, length in enumerate(links, start=1):
        frame = f'<pose relative_to="joint_{number}"/>'
        pose = f"0 0 {_ARM_HEIGHT} 0 0 0" if number == 1 else ""
        solid, moments = _box(length, _LINK_WIDTH, _LINK_HEIGHT)
        centre = f"{0.5 * length:.9g} 0 0"
        inertial = _inertial(centre, 1.0, moments)
        link = _link(f"link_{number}", pose, inertial, [(centre, solid)], LINK_IN_MODELS)
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


def _grasp_frames(grasps: Sequence[Point], digits: int = 9) -> list[str]:
    """Frames at (x, y) [m] that face an angle [rad]."""
    return [
        f'    <frame name="grasp_{k}" attached_to="body">'
        f"<pose>{x:.{digits}g} {y:.{digits}g} 0 0 0 {float(yaw)!r}</pose></frame>"
        for k, (x, y, yaw) in enumerate(grasps)
    ]


def _inertial(centre: str, mass: float, moments: Sequence[float], digits: int = 9) -> str:
    """Mass [kg] and moments xx, yy, zz, and perhaps xy, about the centre of mass [kg m^2]."""
    m, xx, yy, zz, xy = (f"{value:.{digits}g}" for value in (mass, *moments, 0.0)[:5])
    return f"""      <inertial>
        <pose>{centre} 0 0 0</pose>
        <mass>{m}</mass>
        <inertia><ixx>{xx}</ixx><iyy>{yy}</iyy><izz>{zz}</izz><ixy>{xy}</ixy><ixz>0</ixz><iyz>0</iyz></inertia>
      </inertial>"""


def _link(name: str, pose: str, inertial: str, solids: Sequence[tuple[str, str]], colour: str) -> str:
    shapes = "\n".join(_solid(*solid, str(k or ""), colour) for k, solid in enumerate(solids))
    return f"""    <link name="{name}">
      <pose>{pose}</pose>
{inertial}
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
