"""Random teams: an object made of boxes, and two to five robots with arms of one to three joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import atan2

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.plant.model_writing import boxes_model, robot_model

Random = np.random.Generator

Box = tuple[float, float, float, float]
"""Centre (x, y), length along x and width along y [m]."""

SHAPES = ("bar", "L", "T", "U")
"""Objects: convex, and three that are not."""

_SHORTEST_EDGE = 0.15
"""Grippers hold edges that are at least this long [m]: wider than a link."""

_PRISMATIC = 0.2
"""Fraction of joints that slide [-]."""


@dataclass(frozen=True)
class Arm:
    """A robot: a disc base and an arm.

    Attributes:
        base_radius: Radius of its base [m].
        links: Lengths from the base's centre to the end effector, with a joint between each two [m].
        slides: For each joint how far it draws the next link in if it is prismatic [m], None if it is
            revolute.
    """

    base_radius: float
    links: tuple[float, ...]
    slides: tuple[float | None, ...]


@dataclass(frozen=True)
class RandomTeam:
    """An object and the robots that hold it.

    Attributes:
        shape: One of ``SHAPES``.
        boxes: What the object is made of.
        grasps: Position (x, y) [m] and angle [rad] of every grasp, x outwards; one for each robot.
        arms: The robots.
    """

    shape: str
    boxes: tuple[Box, ...]
    grasps: tuple[tuple[float, float, float], ...]
    arms: tuple[Arm, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the robots."""
        return tuple(f"robot_{k}" for k in range(len(self.arms)))

    @property
    def joints(self) -> int:
        """Number of joints of all robots."""
        return sum(len(arm.slides) for arm in self.arms)

    @property
    def kind(self) -> str:
        """The object's shape, and whether any joint slides."""
        slides = any(slide is not None for arm in self.arms for slide in arm.slides)
        return f"{self.shape}, prismatic" if slides else self.shape

    def models(self) -> dict[str, str]:
        """Texts of the model files by their names."""
        texts = {"object.sdf": boxes_model(self.boxes, self.grasps, 1.0, f"A carried object: {self.shape}.")}
        for name, arm in zip(self.names, self.arms, strict=True):
            texts[f"{name}.sdf"] = robot_model(name, arm.links, arm.base_radius, arm.slides)
        return texts


def random_count(random: Random, counts: Sequence[int]) -> int:
    """Draw one of some numbers; each is a third as likely as the one before."""
    weights = np.power(1.0 / 3.0, np.arange(len(counts)))
    return int(random.choice(counts, p=weights / weights.sum()))


def random_team(random: Random, robots: int, most_joints: int) -> RandomTeam | None:
    """Draw a team, None where the drawn object has too few edges to hold.

    Whether its bodies are apart with straight arms is for the reader of the models to say.

    Args:
        random: Source of all draws.
        robots: Number of robots.
        most_joints: Largest number of joints of a robot.
    """
    shape = str(random.choice(SHAPES))
    boxes = _boxes(random, shape, float(random.uniform(0.6, 1.0 + 0.15 * robots)))
    places = _graspable(boxes)
    if len(places) < robots:
        return None
    grasps = tuple(places[k] for k in random.permutation(len(places))[:robots])
    return RandomTeam(shape, boxes, grasps, tuple(_arm(random, most_joints) for _ in range(robots)))


def _arm(random: Random, most_joints: int) -> Arm:
    joints = random_count(random, range(1, 1 + most_joints))
    base = round(float(random.uniform(0.15, 0.3)), 3)
    links = [round(base + float(random.uniform(0.1, 0.25)), 3)]
    links += [round(float(random.uniform(0.2, 0.7)) / joints**0.5, 3) for _ in range(joints)]
    # A sliding link stays clear of the base, to which the first link belongs, and keeps half of the others.
    rooms = [links[0] - base, *[0.5 * link for link in links[1:]]]
    slides = tuple(
        round(float(random.uniform(0.5, 0.9)) * room, 3) if random.random() < _PRISMATIC else None
        for room in rooms[:joints]
    )
    return Arm(base, tuple(links), slides)


def _boxes(random: Random, shape: str, size: float) -> tuple[Box, ...]:
    """Boxes that touch along sides, in a square of some size about the origin."""
    half, thick = 0.5 * size, float(random.uniform(0.15, 0.4)) * size
    off = half - 0.5 * thick
    if shape == "bar":
        parts = [(0.0, 0.0, size, float(random.uniform(0.25, 0.9)) * size)]
    elif shape == "L":
        parts = [(0.0, -off, size, thick), (-off, 0.5 * thick, thick, size - thick)]
    elif shape == "T":
        parts = [(0.0, off, size, thick), (0.0, -0.5 * thick, thick, size - thick)]
    else:
        thick = min(thick, size / 3.0)
        off = half - 0.5 * thick
        parts = [(0.0, -off, size, thick)]
        parts += [(side * off, 0.5 * thick, thick, size - thick) for side in (-1.0, 1.0)]
    return tuple((round(x, 3), round(y, 3), round(a, 3), round(b, 3)) for x, y, a, b in parts)


def _graspable(boxes: tuple[Box, ...]) -> list[tuple[float, float, float]]:
    """Middles of the outline's edges, also quarters of long ones, with the angle of the outward normal."""
    solids = [shapely.box(x - 0.5 * a, y - 0.5 * b, x + 0.5 * a, y + 0.5 * b) for x, y, a, b in boxes]
    # Coordinates are rounded to millimetres; pieces are joined across gaps of that size.
    outline = shapely.union_all([solid.buffer(2e-3, join_style="mitre") for solid in solids])
    whole = outline.buffer(-2e-3, join_style="mitre").simplify(2e-3)
    assert isinstance(whole, Polygon)
    ring = shapely.get_coordinates(shapely.orient_polygons(whole).exterior)
    places = []
    for first, last in pairwise(ring):
        along = last - first
        length = float(np.hypot(*along))
        shares = (0.5,) if length < 0.5 else (0.25, 0.5, 0.75)
        angle = atan2(-along[0], along[1])
        if length >= _SHORTEST_EDGE:
            middles = [first + share * along for share in shares]
            places += [(round(float(x), 6), round(float(y), 6), angle) for x, y in middles]
    return places
