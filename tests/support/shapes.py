"""Random floors for hypothesis: rooms in a chain, less some pillars, from tidy to ragged."""

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st
from shapely import Polygon, box, union_all

from coop_drake.geometry import pole


@st.composite
def floors(draw, *, pillars=4, ragged=True):
    """A connected floor of several square metres, a polygon with up to ``pillars`` holes or bays."""
    count = draw(st.integers(1, 4))
    rooms, x, y = [], 0.0, 0.0
    for _ in range(count):
        w, h = draw(st.floats(0.6, 3.0)), draw(st.floats(0.6, 3.0))
        rooms.append(box(x, y, x + w, y + h))
        x, y = x + w * draw(st.floats(0.1, 0.9)), y + h * draw(st.floats(0.1, 0.9))
    floor = union_all(rooms)
    for _ in range(draw(st.integers(0, pillars))):
        x0, y0, x1, y1 = floor.bounds
        px, py = draw(st.floats(x0, x1)), draw(st.floats(y0, y1))
        angles = np.sort(draw(st.lists(st.floats(0.0, 6.28), min_size=3, max_size=6, unique=True)))
        size = draw(st.floats(0.02, 0.3))
        corners = np.stack([px + size * np.cos(angles), py + size * np.sin(angles)], axis=1)
        # To a nanometre: with edges of 1e-300 m GEOS, the oracle, divides by zero.
        pillar = Polygon(np.round(corners, 9))
        floor = floor.difference(pillar.buffer(0.0))
    if ragged and draw(st.booleans()):
        floor = floor.buffer(-0.03).buffer(draw(st.floats(0.005, 0.02)))
    floor = max(getattr(floor, "geoms", [floor]), key=lambda part: part.area)
    assume(isinstance(floor, Polygon) and floor.area > 0.1 and floor.is_valid)
    return floor


@st.composite
def floors_with_ends(draw):
    """A floor with two points in it that keep a few millimetres from the walls."""
    floor = draw(floors())
    x0, y0, x1, y1 = floor.bounds
    ends = []
    for _ in range(2):
        inner = floor.buffer(-draw(st.floats(0.005, 0.1)))
        parts = [part for part in getattr(inner, "geoms", [inner]) if not part.is_empty]
        assume(parts)
        ends.append(pole(parts[draw(st.integers(0, len(parts) - 1))])[0])
        halves = [box(x0, y0, 0.5 * (x0 + x1), y1), box(0.5 * (x0 + x1), y0, x1, y1)]
        half = floor.buffer(-0.01).intersection(halves[draw(st.integers(0, 1))])
        parts = [
            part for part in getattr(half, "geoms", [half]) if isinstance(part, Polygon) and part.area > 1e-4
        ]
        if parts:
            ends[-1] = pole(parts[0])[0]
    return floor, ends
