"""Compile the maps' kernels once, into numba's cache: ``python -m coop_drake.fields.warm_up``."""

from __future__ import annotations

import numpy as np
from shapely import Point, Polygon

from coop_drake.fields.harmonic_map import HarmonicMap
from coop_drake.fields.velocity_field import VelocityField

_TOLERANCE = 1e-4
# A spike beside a long wall with many short edges takes every way of summing: near, far and down a corner.
_OUTLINE = [
    (0.0, 0.0),
    (4.0, 0.0),
    (4.0, 0.3),
    (1.0, 0.4),
    *((1.0 + 0.03 * k, 0.6) for k in range(40)),
    (0.0, 1.0),
]
_HOLE = [(0.3, 0.4), (0.4, 0.4), (0.35, 0.5)]


def main() -> None:
    """Map a bent room with a pillar, and ask one point and many: this calls every kernel."""
    goal = Point(3.5, 0.2)
    harmonic_map = HarmonicMap(Polygon(_OUTLINE, [_HOLE]), goal, tolerance=_TOLERANCE)
    points = np.array([[0.2, 0.2], [2.0, 0.2]])
    field = VelocityField(harmonic_map)
    for ask in (harmonic_map, field):
        ask(points[0])
        ask(points)


if __name__ == "__main__":
    main()
