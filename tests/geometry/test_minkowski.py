import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import MultiPoint, MultiPolygon, Polygon, box, union_all
from shapely.affinity import translate

from coop_drake.geometry import minkowski
from coop_drake.geometry.minkowski import FreeSpace, common, to_polygon
from coop_drake.geometry.polygons import polygon_rings
from tests.support.trees import room

POINTS = st.lists(st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)), min_size=3, max_size=9)


def convex_ring(points: list[tuple[float, float]]) -> np.ndarray | None:
    hull = MultiPoint(points).convex_hull
    if not isinstance(hull, Polygon) or hull.area < 1e-3:
        return None
    return polygon_rings(hull)[0]


def exact_difference(workspace: Polygon, footprint: np.ndarray) -> Polygon | MultiPolygon:
    """W minus F by hulls of edge sums, in another library and another order of operations."""
    walls = [
        MultiPoint([tuple(end - vertex) for end in (a, b) for vertex in footprint]).convex_hull
        for ring in polygon_rings(workspace)
        for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True)
    ]
    return translate(workspace, *-footprint[0]).difference(union_all(walls))


def as_shapely(section) -> MultiPolygon:
    return MultiPolygon([to_polygon(part) for part in section.decompose()])


@settings(max_examples=60)
@given(POINTS)
def test_difference_equals_the_reference_on_a_floor_with_holes(points: list[tuple[float, float]]) -> None:
    footprint = convex_ring(points)
    if footprint is None:
        return
    exact = exact_difference(room(), footprint)
    found = as_shapely(FreeSpace(polygon_rings(room())).minus(footprint))
    assert found.symmetric_difference(exact).area < 1e-5


@settings(max_examples=30)
@given(POINTS)
def test_the_difference_for_large_floors_equals_the_reference(points: list[tuple[float, float]]) -> None:
    footprint = convex_ring(points)
    if footprint is None:
        return
    space = FreeSpace(polygon_rings(room()))
    found = as_shapely(minkowski.fitting_on_large_floor(space.rings, space.edges, footprint))
    assert found.symmetric_difference(exact_difference(room(), footprint)).area < 1e-5


def test_saw_teeth_are_subtracted_alike_by_few_and_by_many_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    teeth = minkowski.LARGE // 2
    x = np.linspace(4.0, 0.0, 2 * teeth)
    saw = np.column_stack([x, np.where(np.arange(2 * teeth) % 2, 3.0, 3.001)])
    space = FreeSpace([np.vstack([[[0.0, 0.0], [4.0, 0.0]], saw])])
    disc = 0.02 * np.array(
        [[np.cos(a), np.sin(a)] for a in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)]
    )
    few = space.minus(disc)
    shifted = few.translate((0.013, 0.011))
    both = common(few, shifted).area()
    monkeypatch.setattr(minkowski, "LARGE", np.inf)
    many = space.minus(disc)
    assert few.area() == pytest.approx(many.area(), abs=1e-6)
    assert (few - many).area() + (many - few).area() < 1e-6
    assert both == pytest.approx(common(few, shifted).area(), abs=1e-6)


@settings(max_examples=60)
@given(POINTS, st.floats(-3, 3), st.floats(-3, 3))
def test_safe_sides_bracket_the_truth(points: list[tuple[float, float]], x: float, y: float) -> None:
    footprint = convex_ring(points)
    if footprint is None:
        return
    under = as_shapely(FreeSpace.under(room()).minus(footprint))
    over = as_shapely(FreeSpace.over(room()).minus(footprint))
    placed = Polygon(footprint + np.array([x, y]))
    here = MultiPoint([(x, y)])
    if under.contains(here):
        assert room().contains(placed)
    if room().contains(placed):
        assert over.intersects(here)
    assert over.buffer(1e-9).contains(under)


@settings(max_examples=40)
@given(POINTS, st.integers(0, 2**32 - 1))
def test_difference_equals_the_reference_on_floors_of_many_parts(
    points: list[tuple[float, float]], seed: int
) -> None:
    footprint = convex_ring(points)
    corners = np.random.default_rng(seed).integers(0, 12, (9, 2)) * 0.25
    floor = union_all([box(x, y, x + 0.25 * (1 + k % 5), y + 0.5) for k, (x, y) in enumerate(corners)])
    floor = floor.difference(union_all([box(x + 0.1, y + 0.1, x + 0.2, y + 0.6) for x, y in corners[:4]]))
    parts = MultiPolygon([part for part in getattr(floor, "geoms", [floor]) if isinstance(part, Polygon)])
    if footprint is None:
        return
    found = as_shapely(FreeSpace.under(parts).minus(0.5 * footprint))
    exact = union_all([exact_difference(part, 0.5 * footprint) for part in parts.geoms])
    assert found.difference(exact).area < 1e-9
    assert exact.difference(found).area < 1e-4
