"""Compiles the kernels of the maps: ``python -m coop_drake.harmonic_maps.warm_up``."""

from __future__ import annotations

import numpy as np
from shapely import Point, Polygon

from coop_drake.harmonic_maps.field import VelocityField
from coop_drake.harmonic_maps.harmonic_map import HarmonicMap

_TOLERANCE = 1e-4
# A spike beside a long wall with many short edges needs every kernel: near, far and at all scales of a
# corner.
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
    """Solve and evaluate the map of a bent room with a pillar, which calls every kernel."""
    goal = Point(3.5, 0.2)
    harmonic_map = HarmonicMap(Polygon(_OUTLINE, [_HOLE]), goal, tolerance=_TOLERANCE)
    VelocityField(harmonic_map)(np.array([[0.2, 0.2], [2.0, 0.2]]))


if __name__ == "__main__":
    main()
