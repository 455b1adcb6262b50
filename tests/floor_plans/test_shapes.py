"""GeoJSON and well-known text, and how lines of any drawing become a room."""

from __future__ import annotations

import json

import pytest
from shapely import Point, Polygon, box, from_wkt

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans import FloorPlanSettings, excess, read_floor_plan

EXACT = FloorPlanSettings(tolerance=0.0)


def write(folder, text, ending="wkt"):
    path = folder / f"hall.{ending}"
    path.write_text(text if isinstance(text, str) else json.dumps(text))
    return path


def feature(coordinates, kind="Polygon", **properties):
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


RING = [[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]
DESK = [[1, 1], [2, 1], [2, 2], [1, 2], [1, 1]]


def test_a_polygon_comes_back_as_it_is(tmp_path):
    text = "POLYGON ((0 0, 9 0, 9.5 4, 5 5.25, 0 4, 0 0), (2 2, 3 2, 2.5 3, 2 2))"
    assert read_floor_plan(write(tmp_path, text), EXACT).polygon.equals(from_wkt(text))
    as_json = {"type": "Polygon", "coordinates": [RING, DESK]}
    assert read_floor_plan(write(tmp_path, as_json, "geojson"), EXACT).polygon.equals(Polygon(RING, [DESK]))


def test_features_are_chosen_by_their_layer(tmp_path):
    collection = {
        "type": "FeatureCollection",
        "features": [
            feature([RING], layer="walls"),
            feature([DESK], layer="desks"),
            feature([1, 1], "Point"),
        ],
    }
    path = write(tmp_path, collection, "geojson")
    assert read_floor_plan(path, EXACT).polygon.equals(Polygon(RING, [DESK]))
    assert read_floor_plan(path, EXACT).notes == ("1 points left out",)
    walls = FloorPlanSettings(layers=("walls",))
    assert read_floor_plan(path, walls).polygon.equals(Polygon(RING))


TWO_ROOMS = "MULTILINESTRING ((0 0, 10 0, 10 6, 0 6, 0 0), (4 0, 4 6))"


def test_the_room_that_holds_the_start_is_meant(tmp_path):
    path = write(tmp_path, TWO_ROOMS)
    assert read_floor_plan(path, EXACT).polygon.equals(box(4, 0, 10, 6))
    chosen = read_floor_plan(path, EXACT, (1.0, 1.0))
    assert chosen.polygon.equals(box(0, 0, 4, 6))
    assert chosen.others == (36.0,)
    with pytest.raises(
        FloorPlanError, match=r"the point \(20, 1\): it stands in none .* the largest place reaches"
    ):
        read_floor_plan(path, EXACT, (20.0, 1.0))


def test_a_door_makes_two_rooms_one(tmp_path):
    path = write(tmp_path, "MULTILINESTRING ((0 0, 10 0, 10 6, 0 6, 0 0), (4 0, 4 2), (4 3, 4 6))")
    plan = read_floor_plan(path, EXACT, (1.0, 1.0))
    assert plan.polygon.contains(Point(8, 2))
    assert not plan.polygon.intersects(
        from_wkt("MULTILINESTRING ((4 0.001, 4 2), (4 3, 4 5.999))").buffer(5e-4)
    )
    assert plan.polygon.contains(from_wkt("LINESTRING (3 2.5, 5 2.5)"))


def test_an_open_outline_is_refused_with_its_gap(tmp_path):
    path = write(tmp_path, "LINESTRING (0 0, 10 0, 10 6, 0 6, 0 0.2)")
    with pytest.raises(
        FloorPlanError, match=r"\(0, 0\): no outline is closed; this end lies 0.2 m from the one"
    ):
        read_floor_plan(path, EXACT)
    closed = read_floor_plan(path, FloorPlanSettings(gap=0.25))
    assert closed.polygon.equals(box(0, 0, 10, 6))
    assert closed.notes == ("2 gaps of up to 0.25 m were closed",)


def test_a_line_that_stops_short_of_a_wall_is_joined_to_it(tmp_path):
    path = write(tmp_path, "MULTILINESTRING ((0 0, 10 0, 10 6, 0 6, 0 0), (4 0.005, 4 5.995))")
    assert read_floor_plan(path, FloorPlanSettings(gap=0.001), (1, 1)).polygon.contains(Point(8, 3))
    assert read_floor_plan(path, FloorPlanSettings(gap=0.01), (1, 1)).polygon.equals(box(0, 0, 4, 6))


REFUSED = {
    "cut short": ('{"type": "Polygon", "coor', "geojson", r"line 1, column .*cut short"),
    "nothing": ("", "wkt", "empty"),
    "no json": ("nonsense", "geojson", "no JSON"),
    "a list": ("[]", "geojson", "is no GeoJSON"),
    "bad kind": ('{"type": "Circle", "coordinates": [0, 0]}', "geojson", "'Circle' is no GeoJSON"),
    "bad coordinates": ('{"type": "Polygon", "coordinates": [[0, "a"]]}', "geojson", "no Polygon"),
    "degrees": (
        '{"type": "FeatureCollection", "crs": {"properties": {"name": "EPSG:4326"}}, "features": []}',
        "geojson",
        "degrees",
    ),
    "no features": ('{"type": "FeatureCollection", "features": []}', "geojson", "holds no line"),
    "not a number": ("POLYGON ((0 0, nan 0, 9 5, 0 0))", "wkt", "not finite|no well-known text"),
    "far away": ("POLYGON ((0 0, 9e9 0, 9 5, 0 0))", "wkt", "beyond a thousand kilometres"),
    "no text": ("POLYGON ((0 0, 9 0, 9 5", "wkt", "no well-known text"),
    "bow tie": ("POLYGON ((0 0, 9 5, 9 0, 0 5, 0 0))", "wkt", r"crosses or touches itself at \(4.5, 2.5\) m"),
    "a point": ("POINT (1 1)", "wkt", "holds no line"),
    "tiny": ("POLYGON ((0 0, 1e-3 0, 0 1e-3, 0 0))", "wkt", "cannot be a floor"),
    "flat": ("LINESTRING (0 0, 5 0, 9 0)", "wkt", "no outline is closed"),
}


@pytest.mark.parametrize(("text", "ending", "message"), REFUSED.values(), ids=REFUSED)
def test_damaged_files_are_refused(tmp_path, text, ending, message):
    with pytest.raises(FloorPlanError, match=message) as caught:
        read_floor_plan(write(tmp_path, text, ending), EXACT)
    assert caught.value.finding
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (FloorPlanSettings(unit="parsec"), "'parsec' is not allowed; use one of mm"),
        (FloorPlanSettings(scale=float("nan")), "scale: nan is not allowed"),
        (FloorPlanSettings(tolerance=-1.0), "tolerance: -1.0 is not allowed"),
        (FloorPlanSettings(layers=("a",)), "has none"),
    ],
)
def test_settings_of_no_use_are_refused(tmp_path, settings, message):
    with pytest.raises(FloorPlanError, match=message):
        read_floor_plan(write(tmp_path, TWO_ROOMS), settings)


@pytest.mark.parametrize("name", ["hall.pdf", "hall.png", "hall", "gone.wkt", "."])
def test_files_of_another_kind_are_refused(tmp_path, name):
    (tmp_path / "hall.pdf").write_text("x")
    (tmp_path / "hall.png").write_text("x")
    with pytest.raises(FloorPlanError):
        read_floor_plan(tmp_path / name)


def test_excess_is_how_far_a_floor_reaches_beyond():
    assert excess(box(1, 1, 2, 2), box(0, 0, 3, 3)) == 0.0
    assert excess(box(1, 1, 2, 3.5), box(0, 0, 3, 3)) == 0.5
