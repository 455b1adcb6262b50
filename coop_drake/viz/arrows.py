"""Arrows in the scene: the force of every robot's end effector on the object, at its grasp."""

from __future__ import annotations

from math import floor, log10, pi

import numpy as np
from pydrake.geometry import Cylinder, Meshcat, MeshcatCone, Rgba
from pydrake.math import RigidTransform, RotationMatrix

from coop_drake.plant import TeamPlant
from coop_drake.tree.pose import FloatArray

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


def force_of_a_metre(team: TeamPlant) -> float:
    """Return the force that an arrow of one metre stands for [N]: about the object's weight per robot."""
    weight = team.object_inertia.mass * _GRAVITY / len(team.robots)
    decade = 10.0 ** floor(log10(weight))
    return next(step * decade for step in (1.0, 2.0, 5.0, 10.0) if step * decade >= weight)


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
