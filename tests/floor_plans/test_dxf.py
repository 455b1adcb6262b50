"""DXF drawings: entities, blocks, layers, units, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import box, contains_xy

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans import FloorPlanSettings, read_floor_plan
from tests.support.floor_plan_files import write_dxf
from tests.support.mutants.floor_plans import DXF

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
    assert not read_floor_plan(path, FloorPlanSettings(layers=("WALLS",))).polygon.interiors
    with pytest.raises(FloorPlanError, match=r"nothing is drawn on layer 'walls'; known: DESKS, FROZEN, OFF"):
        read_floor_plan(path, FloorPlanSettings(layers=("walls",)))


def test_the_width_of_a_polyline_belongs_to_the_wall(tmp_path):
    def draw(document, space):
        space.add_lwpolyline(HALL, close=True, dxfattribs={"const_width": 200})

    got = read_floor_plan(write_dxf(tmp_path, draw)).polygon
    assert got.symmetric_difference(box(0.1, 0.1, 9.9, 5.9)).area < 1e-9


def test_a_drawing_cut_short_is_refused_wherever_it_ends(tmp_path):
    whole = write_dxf(tmp_path, hall).read_bytes()
    for share in (0.1, 0.5, 0.9, 0.999):
        path = tmp_path / "cut.dxf"
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(FloorPlanError, match="cut short"):
            read_floor_plan(path)


def test_a_drawing_of_no_sense_is_refused(tmp_path):
    path = tmp_path / "hall.dxf"
    for content in (b"hello\nEOF\n", b"  0\nSECTION\n  2\nENTITIES\n  0\nEOF\n"):
        path.write_bytes(content)
        with pytest.raises(FloorPlanError):
            read_floor_plan(path, FloorPlanSettings(unit="m"))


def test_what_the_reader_warns_of_is_a_note_and_not_a_line_on_the_screen(tmp_path, capsys):
    path = tmp_path / "hall.dxf"
    tables = b"0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLTYPE\n70\n1\n0\nWIDE\n2\nx\n0\nENDTAB\n0\nENDSEC\n"
    entities = DXF.index(b"0\nSECTION\n2\nENTITIES")
    path.write_bytes(DXF[:entities] + tables + DXF[entities:])
    notes = read_floor_plan(path).notes
    assert any(note.startswith("while reading: ") and "WIDE" in note for note in notes), notes
    assert capsys.readouterr().err == ""
