"""Floors from polygons in text, from occupancy maps, and by the command floor-plan."""

from __future__ import annotations

import json
from math import cos, pi, sin

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, affinity, box, contains_xy, from_wkt, union_all
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans import FloorPlanSettings, Inside, excess, read_floor_plan
from coop_drake.floor_plans.map_file import OccupancyMap, room_of_map
from tests.support.floor_plan_files import HALL, room_shades, write_map, write_svg

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
    "degrees": (
        '{"type": "FeatureCollection", "crs": {"properties": {"name": "EPSG:4326"}}, "features": []}',
        "geojson",
        "degrees",
    ),
    "no features": ('{"type": "FeatureCollection", "features": []}', "geojson", "holds no line"),
    "not a number": ("POLYGON ((0 0, nan 0, 9 5, 0 0))", "wkt", "not finite|no well-known text"),
    "far away": ("POLYGON ((0 0, 9e9 0, 9 5, 0 0))", "wkt", "beyond a thousand kilometres"),
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


def test_free_cells_make_the_floor_row_zero_on_top(tmp_path):
    shades = room_shades()
    shades[3:6, 10:20] = 0  # A shelf near the top.
    plan = read_floor_plan(write_map(tmp_path, shades), EXACT)
    want = box(0.1, 0.1, 3.9, 2.9) - box(1.0, 2.4, 2.0, 2.7)
    assert plan.polygon.symmetric_difference(want).area < 1e-9
    assert len(plan.polygon.exterior.coords) == 5


def test_the_origin_turns_and_moves_the_map(tmp_path):
    pose = [1.0, -2.0, 0.5]
    plan = read_floor_plan(write_map(tmp_path, room_shades(), origin=pose, ending="png"), EXACT)
    turned = affinity.affine_transform(
        box(0.1, 0.1, 3.9, 2.9), [cos(0.5), -sin(0.5), sin(0.5), cos(0.5), 1.0, -2.0]
    )
    assert plan.polygon.symmetric_difference(turned).area < 1e-9


SHADES = {  # shade, keys of the file -> whether the cell is floor
    "white": (254, {}, True),
    "unknown": (205, {}, False),
    "black": (0, {}, False),
    "just free": (206, {}, True),  # 1 - 206/255 = 0.192
    "negated white": (254, {"negate": 1}, False),
    "negated black": (0, {"negate": 1}, True),
    "free threshold moved": (205, {"free_thresh": 0.25}, True),
    "scale, between": (180, {"mode": "scale"}, False),
    "scale, free": (250, {"mode": "scale"}, True),
    "raw, free": (0, {"mode": "raw"}, True),
    "raw, ten percent": (10, {"mode": "raw"}, True),
    "raw, half": (50, {"mode": "raw"}, False),
    "raw, unknown": (255, {"mode": "raw"}, False),
}


@pytest.mark.parametrize(("shade", "keys", "is_floor"), SHADES.values(), ids=SHADES)
def test_what_shades_mean(tmp_path, shade, keys, is_floor):
    free = 0 if keys.get("mode") == "raw" or keys.get("negate") else 254
    shades = np.full((12, 12), free)
    shades[5:8, 5:8] = shade
    plan = read_floor_plan(write_map(tmp_path, shades, **keys), EXACT, (0.15, 0.15))
    assert plan.polygon.contains(Point(0.65, 0.55)) == is_floor


def test_unknown_cells_are_floor_only_where_that_is_said(tmp_path):
    shades = room_shades()
    shades[10:20, 10:20] = 205
    path = write_map(tmp_path, shades)
    assert len(read_floor_plan(path, EXACT).polygon.interiors) == 1
    assert not read_floor_plan(path, FloorPlanSettings(unknown_is_free=True)).polygon.interiors


def test_transparent_cells_are_unknown(tmp_path):
    from PIL import Image

    path = write_map(tmp_path, room_shades(), ending="png")
    pixels = np.full((30, 40, 4), 254, dtype=np.uint8)
    pixels[..., 3] = 255
    pixels[10:20, 10:20, 3] = 0
    Image.fromarray(pixels).save(tmp_path / "map.png")
    assert len(read_floor_plan(path, EXACT).polygon.interiors) == 1


def test_the_room_of_the_start_is_meant_and_diagonal_cells_do_not_connect(tmp_path):
    shades = np.zeros((21, 21))
    shades[1:10, 1:10] = shades[10:20, 10:20] = 254
    path = write_map(tmp_path, shades)
    assert read_floor_plan(path, EXACT).polygon.area == pytest.approx(1.0)
    other = read_floor_plan(path, EXACT, (0.5, 1.5))
    assert other.polygon.area == pytest.approx(0.81)
    assert other.others == pytest.approx((1.0,))
    with pytest.raises(
        FloorPlanError, match=r"the point \(0.5, 0.5\): it stands on no free cell; the map reaches"
    ):
        read_floor_plan(path, EXACT, (0.5, 0.5))


@settings(max_examples=60)
@given(
    st.lists(st.lists(st.booleans(), min_size=9, max_size=9), min_size=9, max_size=9),
    st.floats(-pi, pi),
    st.sampled_from([0.0, 0.1, 0.2]),
)
def test_the_floor_lies_inside_the_free_cells_and_its_rings_never_touch(rows, yaw, closing):
    free = np.array(rows)
    free[4, 4] = True
    cells = OccupancyMap(free, ~free, 0.1, (3.0, -1.0, yaw))
    centre = tuple(cells.place(np.array([[4.5, 4.5]]))[0])
    try:
        floor = room_of_map(cells, "map", Inside(*centre), unknown_is_free=False, closing=closing).floor
    except FloorPlanError:
        return  # Closing or cutting corners off took the start's cell.
    squares = [
        box(column, row, column + 1, row + 1) for row in range(9) for column in range(9) if free[row, column]
    ]
    union = union_all(squares)
    back = cells.place(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    (a, d), (b, e) = back[1] - back[0], back[2] - back[0]
    placed = affinity.affine_transform(union, [a, b, d, e, *back[0]])
    assert floor.is_valid
    assert floor.difference(placed).area < 1e-12
    assert floor.contains(Point(centre))
    rings = [floor.exterior, *floor.interiors]
    assert all(ring.is_simple for ring in rings)
    assert all(a.disjoint(b) for place, a in enumerate(rings) for b in rings[:place])


def test_rough_walls_of_a_large_map_are_saved_many_corners(tmp_path):
    random = np.random.default_rng(0)
    shades = room_shades(600, 800)
    shades[200:400, 300:320] = 0
    near = np.zeros_like(shades, dtype=bool)
    near[:4] = near[-4:] = near[:, :4] = near[:, -4:] = near[197:403, 297:323] = True
    shades[near & (random.random(shades.shape) < 0.4)] = 0
    path = write_map(tmp_path, shades, resolution=0.02)
    plan = read_floor_plan(path, FloorPlanSettings(tolerance=0.1), (2.0, 2.0))
    corners = sum(len(ring.coords) - 1 for ring in (plan.polygon.exterior, *plan.polygon.interiors))
    assert corners < 60
    assert excess(plan.polygon, plan.drawn) < 1e-9
    rows, columns = np.nonzero(shades == 0)
    centres = np.column_stack([columns + 0.5, 600 - rows - 0.5]) * 0.02
    assert not contains_xy(plan.polygon, centres).any()
    assert plan.polygon.area > 0.97 * plan.drawn.area


WRONG_KEYS = {
    "resolution of zero": ({"resolution": 0}, "cells of 0 m"),
    "origin too short": ({"origin": [0, 0]}, r"origin: \[0, 0\] is no pose"),
    "mode": ({"mode": "quaternary"}, "'quaternary' is unknown; use one of trinary, scale, raw"),
    "negate": ({"negate": 2}, "negate: 2 is neither 0 nor 1"),
    "thresholds": ({"free_thresh": 0.8}, "do not part the shades"),
    "no image": ({"image": ...}, "names no picture"),
    "gone": ({"image": "gone.pgm"}, "there is no .*gone.pgm"),
    "nothing free": ({"negate": 1, "free_thresh": 0.0}, "no cell is free"),
}


@pytest.mark.parametrize(("keys", "message"), WRONG_KEYS.values(), ids=WRONG_KEYS)
def test_wrong_keys_are_refused(tmp_path, keys, message):
    with pytest.raises(FloorPlanError, match=message):
        read_floor_plan(write_map(tmp_path, room_shades(), **keys))


BODY = f'{HALL}<circle cx="3" cy="3" r="1"/><text>hall</text>'


def call(*arguments):
    return CliRunner().invoke(app, ["floor-plan", *map(str, arguments)])


def test_it_writes_a_workspace_that_is_the_floor_and_pictures(tmp_path):
    drawing = write_svg(tmp_path, BODY)
    targets = [tmp_path / name for name in ("w.yaml", "w.png", "w.svg")]
    outs = [word for target in targets for word in ("--out", target)]
    done = call(drawing, "--unit", "m", "--inside", 1, 1, *outs, "--json")
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    assert facts["obstacles"] == 1
    assert facts["notes"] == ["1 <text> left out"]
    section = yaml.safe_load(targets[0].read_text())["workspace"]
    read = Polygon(section["outer"], section["holes"])
    want = read_floor_plan(drawing, FloorPlanSettings(unit="m")).polygon
    assert read.symmetric_difference(want).area < 1e-7
    assert targets[1].read_bytes().startswith(b"\x89PNG")
    first = targets[2].read_bytes()
    call(drawing, "--unit", "m", "--inside", 1, 1, *outs)
    assert targets[2].read_bytes() == first


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["hall.svg", "--unit", "feet"], "'feet' is not allowed; use one of mm, cm"),
        (["hall.svg", "--unit", "m", "--inside", "20", "20"], "--inside (20, 20): it stands in none"),
        (["gone.svg"], "cannot be read"),
        (["hall.svg", "--out", "hall.pdf"], "ends neither in .yaml nor in .png or .svg"),
        (["hall.svg", "--out", "hall.svg"], "is the floor plan itself"),
    ],
)
def test_what_it_cannot_do_leaves_nothing_behind(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    write_svg(tmp_path, BODY)
    done = call(*arguments, "--out", "w.yaml")
    assert done.exit_code == 2
    assert message in " ".join(done.output.split())
    assert [path.name for path in tmp_path.iterdir()] == ["hall.svg"]
