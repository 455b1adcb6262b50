"""What must hold for the map and its field on every simply connected polygon."""

import numpy as np
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, affinity, box

from coop_drake.fields import HarmonicMap, VelocityField
from tests.support import domains

FEW = settings(
    max_examples=12,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)


@st.composite
def stars(draw):
    """A star-shaped polygon with 4 to 14 vertices."""
    radii = draw(st.lists(st.floats(0.25, 1.5), min_size=4, max_size=14))
    shifts = draw(st.lists(st.floats(-0.35, 0.35), min_size=len(radii), max_size=len(radii)))
    angle = 2 * np.pi * (np.arange(len(radii)) + np.array(shifts)) / len(radii)
    return Polygon(np.column_stack((radii * np.cos(angle), radii * np.sin(angle))))


@st.composite
def corridors(draw):
    """Boxes along a walk on a lattice: corridors, rooms and doors, holes filled."""
    width = draw(st.sampled_from([0.2, 0.35, 0.6, 0.9]))
    x = y = 0
    boxes = [box(-0.5, -0.4, 0.45, 0.5)]
    for dx, dy in draw(st.lists(st.sampled_from([(1, 0), (0, 1), (-1, 0), (0, -1)]), min_size=2, max_size=7)):
        line = shapely.LineString([(x, y), (x + dx, y + dy)])
        boxes.append(line.buffer(width / 2, cap_style="square"))
        x, y = x + dx, y + dy
    return Polygon(shapely.union_all(boxes).exterior)


CELLS = st.one_of(stars(), corridors())


def goal_of(cell):
    return Point(shapely.maximum_inscribed_circle(cell).coords[0])


def flow(field, start, goal, region, *, tolerance=1e-3, max_steps=20_000):
    """Follow a streamline by Heun's rule with steps that shorten near walls; None if it does not arrive."""
    point = np.array(start, dtype=float)
    shapely.prepare(region)
    for _ in range(max_steps):
        remaining = np.hypot(*(point - goal))
        if remaining < tolerance:
            return point
        clearance = region.boundary.distance(Point(point))
        length = min(0.3 * clearance + 1e-4, 0.3 * remaining)
        first = unit(field(point))
        second = unit(field(point + length * first))
        point = point + 0.5 * length * (first + second)
        if not shapely.contains_xy(region, *point):
            return None
    return None


def unit(velocity):
    return velocity / np.hypot(*velocity)


@FEW
@given(CELLS)
def test_every_streamline_stays_inside_and_arrives(cell):
    goal = goal_of(cell)
    field = VelocityField(HarmonicMap(cell, goal))
    starts = domains.inside(cell, 40, clearance=1e-3)[:8]
    end = np.array(goal.coords[0])
    lost = [start for start in starts if flow(field, start, end, cell) is None]
    assert not lost


@FEW
@given(CELLS)
def test_disk_is_filled_without_folds_and_walls_push_inwards(cell):
    harmonic_map = HarmonicMap(cell, goal_of(cell))
    field = VelocityField(harmonic_map)
    near, _ = domains.off_wall(cell, 1e-3)
    near = near[shapely.contains_xy(cell, *near.T)]
    T, J = harmonic_map(np.concatenate((domains.inside(cell, 2000), near)))
    assert (np.hypot(*T.T) < 1.0).all()
    det = np.linalg.det(J)
    noise = 1e-6 * np.linalg.norm(J, axis=(1, 2)) ** 2
    assert (det > -noise).all()
    walls, normals = domains.off_wall(cell, 0.0)
    assert min(field(p) @ n for p, n in zip(walls, normals, strict=True)) > 0.0


@FEW
@given(CELLS, st.floats(-3.0, 3.0), st.floats(0.05, 20.0), st.floats(-50.0, 50.0))
def test_direction_turns_with_the_cell_and_ignores_its_place_and_size(cell, angle, scale, shift):
    def moved(shape):
        turned = affinity.rotate(shape, angle, origin=(0, 0), use_radians=True)
        return affinity.translate(affinity.scale(turned, scale, scale, origin=(0, 0)), shift, -shift)

    goal = goal_of(cell)
    here = VelocityField(HarmonicMap(cell, goal))
    there = VelocityField(HarmonicMap(moved(cell), moved(goal)))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for point in domains.inside(cell, 30, clearance=0.01):
        image = np.asarray(moved(Point(point)).coords[0])
        np.testing.assert_allclose(unit(there(image)), turn @ unit(here(point)), atol=1e-4)


@FEW
@given(CELLS)
def test_certificate_holds_on_the_whole_boundary(cell):
    harmonic_map = HarmonicMap(cell, goal_of(cell))
    ring = shapely.segmentize(harmonic_map.region.exterior, 0.003)
    T, _ = harmonic_map(shapely.get_coordinates(ring))
    bound = 1.5 * harmonic_map.certificate.error_bound + 1e-12
    assert np.abs(np.hypot(*T.T) - 1.0).max() <= bound
    assert harmonic_map.certificate.residual <= 1e-6
