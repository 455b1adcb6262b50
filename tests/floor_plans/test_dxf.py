"""DXF drawings: entities, blocks, layers, units, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import box, contains_xy

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans import FloorPlanSettings, read_floor_plan
from tests.support.floor_plan_files import DXF, write_dxf

HALL = [(0, 0), (10_000, 0), (10_000, 6_000), (0, 6_000)]


def hall(document, space):
    space.add_lwpolyline(HALL, close=True, dxfattribs={"layer": "WALLS"})


def test_lines_make_a_room_in_the_unit_of_the_head(tmp_path):
    def draw(document, space):
        for start, end in zip(HALL, HALL[1:] + HALL[:1], strict=True):
            space.add_line(start, end)

    assert read_floor_plan(write_dxf(tmp_path, draw)).polygon.equals(box(0, 0, 10, 6))
    inches = FloorPlanSettings(unit="in", scale=1 / 25.4)
    assert read_floor_plan(write_dxf(tmp_path, draw), inches).polygon.area == pytest.approx(60.0)
    with pytest.raises(FloorPlanError, match="does not say what its unit is"):
        read_floor_plan(write_dxf(tmp_path, draw, unit=0))
    with pytest.raises(FloorPlanError, match=r"it is 1e\+04 m by 6000 m, which cannot be a floor"):
        read_floor_plan(write_dxf(tmp_path, draw), FloorPlanSettings(unit="m"))


def test_round_walls_are_enclosed_from_the_floors_side(tmp_path):
    def draw(document, space):
        hall(document, space)
        space.add_circle((2_000, 3_000), 500)
        space.add_arc((5_000, 3_000), 700, 20, 200)
        space.add_line(
            (5_000 + 700 * np.cos(np.radians(20)), 3_000 + 700 * np.sin(np.radians(20))),
            (5_000 - 700 * np.cos(np.radians(20)), 3_000 - 700 * np.sin(np.radians(20))),
        )
        space.add_lwpolyline([(7_000, 2_000, 1.0), (8_000, 2_000, 1.0)], format="xyb", close=True)

    plan = read_floor_plan(write_dxf(tmp_path, draw), FloorPlanSettings(tolerance=0.02), (0.5, 0.5))
    turn = np.linspace(0, 2 * np.pi, 1000)
    half = np.radians(np.linspace(20, 200, 500))
    for centre, radius, angles in (((2, 3), 0.5, turn), ((5, 3), 0.7, half), ((7.5, 2), 0.5, turn)):
        circle = np.column_stack([np.cos(angles), np.sin(angles)]) * radius + centre
        assert not contains_xy(plan.polygon, circle).any()
    assert len(plan.polygon.interiors) == 3
    assert plan.polygon.area > 60.0 - np.pi * (0.25 + 0.25 + 0.245) - 0.3


def test_blocks_are_put_in_scaled_turned_and_mirrored(tmp_path):
    def draw(document, space):
        hall(document, space)
        shelf = document.blocks.new("SHELF")
        shelf.add_lwpolyline([(0, 0), (2, 0), (2, 1)], close=True)
        space.add_blockref(
            "SHELF", (4_000, 2_000), {"xscale": -500, "yscale": 500, "rotation": 90, "layer": "SHELVES"}
        )

    path = write_dxf(tmp_path, draw)
    (hole,) = read_floor_plan(path).polygon.interiors
    assert len(read_floor_plan(path, FloorPlanSettings(layers=("WALLS", "SHELVES"))).polygon.interiors) == 1
    assert not read_floor_plan(path, FloorPlanSettings(layers=("WALLS",))).polygon.interiors
    assert set(hole.coords) == {(4.0, 2.0), (4.0, 1.0), (3.5, 1.0)}


def test_layers_are_chosen_and_hidden_ones_left_out(tmp_path):
    def draw(document, space):
        hall(document, space)
        for place, name in enumerate(("DESKS", "OFF", "FROZEN")):
            document.layers.add(name)
            corner = 1_000 + 2_000 * place
            space.add_lwpolyline(
                [(corner, 1_000), (corner + 500, 1_000), (corner, 1_500)],
                close=True,
                dxfattribs={"layer": name},
            )
        document.layers.get("OFF").off()
        document.layers.get("FROZEN").freeze()
        space.add_text("Hall 1", dxfattribs={"layer": "WALLS"})

    path = write_dxf(tmp_path, draw)
    shown = read_floor_plan(path)
    assert len(shown.polygon.interiors) == 1
    assert "1 TEXT left out" in shown.notes
    for name in ("WALLS", "Walls"):
        assert not read_floor_plan(path, FloorPlanSettings(layers=(name,))).polygon.interiors
    with pytest.raises(FloorPlanError, match=r"nothing is drawn on layer 'wall'; known: DESKS, FROZEN, OFF"):
        read_floor_plan(path, FloorPlanSettings(layers=("wall",)))


def square(space, x, layer, size=500):
    corners = [(x, 1_000), (x + size, 1_000), (x + size, 1_000 + size), (x, 1_000 + size)]
    space.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})


def places(path, settings=None):
    """Where obstacles stand: their smallest x [m]."""
    holes = read_floor_plan(path, settings, (0.1, 0.1)).polygon.interiors
    return sorted(round(min(x for x, _ in hole.coords), 9) for hole in holes)


def test_names_of_layers_compare_without_case(tmp_path):
    def draw(document, space):
        hall(document, space)
        document.layers.add("Furniture").freeze()
        square(space, 1_000, "FURNITURE")
        square(space, 2_000, "Desks")
        square(space, 3_000, "DESKS")

    path = write_dxf(tmp_path, draw)
    assert places(path) == [2.0, 3.0]
    assert places(path, FloorPlanSettings(layers=("walls", "desks"))) == [2.0, 3.0]


@pytest.mark.parametrize(
    ("state", "seen"),
    [
        # Of the block, what lies on layer 0 takes the layer of the insert; the rest has layers of its own.
        ("freeze", [8.0]),
        ("off", [2.0, 4.0, 8.0]),
        ("lock", [1.0, 2.0, 3.0, 4.0, 8.0]),
    ],
)
def test_a_frozen_layer_hides_whole_blocks_and_one_that_is_off_only_what_lies_on_it(tmp_path, state, seen):
    def draw(document, space):
        hall(document, space)
        getattr(document.layers.add("Shelves"), state)()
        inner = document.blocks.new("INNER")
        square(inner, 3_000, "0")
        square(inner, 4_000, "PARTS")
        outer = document.blocks.new("OUTER")
        square(outer, 1_000, "0")
        square(outer, 2_000, "PARTS")
        outer.add_blockref("INNER", (0, 0), {"layer": "0"})
        space.add_blockref("OUTER", (0, 0), {"layer": "SHELVES"})
        hidden = space.add_blockref("OUTER", (0, 2_000))
        hidden.dxf.invisible = 1
        square(space, 8_000, "PARTS")

    assert places(write_dxf(tmp_path, draw)) == seen


def test_what_only_a_viewport_or_the_paper_hides_or_shows_does_not_count(tmp_path):
    def draw(document, space):
        hall(document, space)
        square(space, 1_000, "Desks")
        paper = document.layout("Layout1")
        square(paper, 3_000, "WALLS")
        viewport = paper.add_viewport((0, 0), (10, 6), (0, 0), 6)
        viewport.frozen_layers = ["Desks"]

    assert places(write_dxf(tmp_path, draw)) == [1.0]


def test_dimensions_hatches_and_leaders_are_no_walls_and_are_counted(tmp_path):
    def draw(document, space):
        hall(document, space)
        space.add_linear_dim(base=(0, 3_000), p1=(0, 0), p2=(10_000, 0)).render()
        space.add_leader([(1_000, 1_000), (9_000, 5_000)])
        hatch = space.add_hatch()
        hatch.paths.add_polyline_path([(2_000, 2_000), (3_000, 2_000), (3_000, 3_000)], is_closed=True)
        block = document.blocks.new("MARKED")
        block.add_linear_dim(base=(0, 4_000), p1=(0, 0), p2=(10_000, 0)).render()
        square(block, 7_000, "0")
        space.add_blockref("MARKED", (0, 0))

    plan = read_floor_plan(write_dxf(tmp_path, draw))
    assert len(plan.polygon.interiors) == 1
    assert {"2 DIMENSION left out", "1 HATCH left out", "1 LEADER left out"} <= set(plan.notes)


def test_wide_polylines_in_stretched_and_mirrored_blocks_are_nowhere_thinner_than_drawn(tmp_path):
    def draw(document, space):
        hall(document, space)
        block = document.blocks.new("PIER")
        block.add_lwpolyline([(0, 0, 200, 200, 0.5), (1_000, 0, 200, 200, 0)], format="xyseb")
        block.add_polyline2d([(0, 500), (1_000, 500)], dxfattribs={"default_start_width": 100})
        around = document.blocks.new("AROUND")
        around.add_blockref("PIER", (0, 0), {"rotation": 30})
        space.add_blockref("AROUND", (5_000, 3_000), {"xscale": -2, "yscale": 1})

    def placed(points):
        turned = np.array(points) @ rotation
        return turned * (-2.0, 1.0) + (5.0, 3.0)

    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    rotation = np.array([(c, s), (-s, c)])
    floor = read_floor_plan(write_dxf(tmp_path, draw), FloorPlanSettings(tolerance=0.001), (0.1, 0.1)).polygon
    angle = np.linspace(-0.5, 0.5, 200) * 4.0 * np.arctan(0.5)
    radius = 0.5 / np.sin(2.0 * np.arctan(0.5))
    middle = 0.5 + 0.5j / np.tan(2.0 * np.arctan(0.5))
    for edge in (radius - 0.0999, radius + 0.0999):
        arc = middle + edge * np.exp(1j * (angle - 0.5 * np.pi))
        assert not contains_xy(floor, placed(np.column_stack([arc.real, arc.imag]))).any()
    for side in (0.4501, 0.5499):
        assert not contains_xy(floor, placed([(x, side) for x in np.linspace(0.001, 0.999, 50)])).any()


def test_a_grid_of_inserts_is_dissolved(tmp_path):
    def draw(document, space):
        hall(document, space)
        square(document.blocks.new("POST"), 0, "0", 100)
        grid = {"row_count": 1, "column_count": 3, "column_spacing": 2_000}
        space.add_blockref("POST", (1_000, 1_000), grid)

    assert places(write_dxf(tmp_path, draw)) == [1.0, 3.0, 5.0]


def test_walls_seen_from_below_are_mirrored_as_their_plane_is(tmp_path):
    def draw(document, space):
        hall(document, space)
        space.add_lwpolyline(
            [(-2_000, 1_000), (-3_000, 1_000), (-3_000, 2_000)],
            close=True,
            dxfattribs={"extrusion": (0, 0, -1)},
        )

    assert places(write_dxf(tmp_path, draw)) == [2.0]


def test_blocks_of_other_files_and_blocks_in_themselves_are_refused(tmp_path):
    def outside(document, space):
        hall(document, space)
        document.add_xref_def("walls.dxf", "WALLS_OF_ELSEWHERE")
        space.add_blockref("WALLS_OF_ELSEWHERE", (0, 0), {"layer": "X"})

    def endless(document, space):
        hall(document, space)
        document.blocks.new("A").add_blockref("A", (0, 0))
        space.add_blockref("A", (0, 0))

    def missing(document, space):
        hall(document, space)
        space.add_blockref("GONE", (0, 0))

    def unseen(document, space):
        outside(document, space)
        document.layers.add("X").freeze()

    with pytest.raises(FloorPlanError, match="the block 'WALLS_OF_ELSEWHERE': it is drawn in another file"):
        read_floor_plan(write_dxf(tmp_path, outside))
    with pytest.raises(FloorPlanError, match="more than 50 blocks inside each other"):
        read_floor_plan(write_dxf(tmp_path, endless))
    with pytest.raises(FloorPlanError, match="the block 'GONE': the file does not define it"):
        read_floor_plan(write_dxf(tmp_path, missing))
    assert read_floor_plan(write_dxf(tmp_path, unseen)).polygon.equals(box(0, 0, 10, 6))


def test_the_width_of_a_polyline_belongs_to_the_wall(tmp_path):
    def draw(document, space):
        space.add_lwpolyline(HALL, close=True, dxfattribs={"const_width": 200})

        space.add_lwpolyline([(0, 3_000), (4_000, 3_000)], dxfattribs={"const_width": 200})

    got = read_floor_plan(write_dxf(tmp_path, draw)).polygon
    assert got.symmetric_difference(box(0.1, 0.1, 9.9, 5.9) - box(0, 2.9, 4, 3.1)).area < 1e-9


def test_what_the_reader_warns_of_is_a_note_and_not_a_line_on_the_screen(tmp_path, capsys):
    path = tmp_path / "hall.dxf"
    tables = b"0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLTYPE\n70\n1\n0\nWIDE\n2\nx\n0\nENDTAB\n0\nENDSEC\n"
    entities = DXF.index(b"0\nSECTION\n2\nENTITIES")
    path.write_bytes(DXF[:entities] + tables + DXF[entities:])
    notes = read_floor_plan(path).notes
    assert any(note.startswith("while reading: ") and "WIDE" in note for note in notes), notes
    assert capsys.readouterr().err == ""
