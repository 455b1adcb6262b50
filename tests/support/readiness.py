"""The ready margin of one robot from plain vectors."""

from __future__ import annotations

import numpy as np
from shapely import box

from coop_drake.geometry.polygons import edges_of
from coop_drake.systems.kernels import robot_ready


def states(position, velocity, axes, rates):
    """Return the object's state and a robot's state for given (theta, q...) and their rates."""
    object_state = np.array([*position, axes[0], *velocity, rates[0]], dtype=float)
    return object_state, np.array([0.0, 0.0, 0.0, *axes[1:], 0.0, 0.0, 0.0, *rates[1:]], dtype=float)


def margin_of(conditions, position, velocity, governor_position, axes, rates, time=10.0):
    """Return ``robot_ready`` of a robot whose conditions are given, ``time`` [s] after the cell's entry."""
    governor = np.array(governor_position, dtype=float)
    return robot_ready(conditions, time, *states(position, velocity, axes, rates), governor)


def square_with_clearance(point, clearance):
    """Return the edges of a square of which a point has this signed distance to the boundary [m]."""
    x, y = point
    if clearance > 0.0:
        return edges_of(box(x - clearance, y - clearance, x + clearance, y + clearance)).copy()
    return edges_of(box(x - clearance, y - 1.0, x - clearance + 1.0, y + 1.0)).copy()
