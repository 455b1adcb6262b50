"""The command floor-plan: what it tells, writes and refuses."""

from __future__ import annotations

import json

import pytest
import yaml
from shapely import Polygon
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.floor_plans import FloorPlanSettings, read_floor_plan
from tests.support.floor_plan_files import HALL, write_svg

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
