"""The unit of length in which a team has the usual size."""

from __future__ import annotations

from math import log2

import numpy as np

from coop_drake.tree.component_tree import ComponentTree

_USUAL_SIZE = 0.25
"""Mean radius of a usual team's convex pieces [m]; steps and resolutions of the search are meant for it."""

_UNUSUAL = 1.5
"""Octaves of size within which a team counts as usual [-]."""


def usual_unit(tree: ComponentTree) -> float:
    """Length in which a team has the usual size: 1 m unless it is about three times larger or smaller.

    It is a power of two, so that no length is rounded when its unit changes.
    """
    shapes = [shape for component in tree.components for body in component.bodies for shape in body.shapes]
    sizes = [float(np.hypot(*np.ptp(shape.vertices, axis=0))) / 2.0 + shape.radius for shape in shapes]
    size = float(np.mean(sizes)) if sizes else 0.0
    octaves = log2(size / _USUAL_SIZE) if size > 0.0 else 0.0
    return 1.0 if abs(octaves) <= _UNUSUAL else 2.0 ** round(octaves)
