"""A scenario may name a floor plan in place of rings."""

from __future__ import annotations

import json

import pytest
import yaml
from shapely import box

from coop_drake.answers.document import problem_digest
from coop_drake.cli.task import read_task
from coop_drake.errors import FloorPlanError, ScenarioError
from coop_drake.scenario import dump_scenario, load_scenario
from tests.support.cli import invoke
from tests.support.floor_plan_files import room_shades, write_map, write_svg
from tests.support.scenarios import write_scenario

SVG = '<rect width="6" height="4"/><rect x="0.5" y="0.5" width="0.5" height="0.5"/>'


def named(folder, **keys):
    write_svg(folder, SVG, 'viewBox="0 0 6 4"')
    return write_scenario(folder / "room.scenario.yaml", workspace={"file": "hall.svg", "unit": "m", **keys})


def test_a_drawing_asks_the_same_question_as_its_rings(tmp_path):
    rings = {
        "outer": [[0, 0], [6, 0], [6, 4], [0, 4]],
        "holes": [[[0.5, 3], [1, 3], [1, 3.5], [0.5, 3.5]]],
    }
    drawn = read_task(named(tmp_path), None)
    written = read_task(write_scenario(tmp_path / "rings.scenario.yaml", workspace=rings), None)
    assert drawn.problem.workspace.equals(written.problem.workspace)
    again = tmp_path / "again.scenario.yaml"
    again.write_text(dump_scenario(load_scenario(tmp_path / "room.scenario.yaml")))
    assert problem_digest(read_task(again, None).problem) == problem_digest(drawn.problem)


def test_a_map_is_read_round_the_start(tmp_path):
    write_map(tmp_path, room_shades(42, 62))
    path = write_scenario(tmp_path / "map.scenario.yaml", workspace={"file": "map.yaml", "tolerance": 0})
    assert load_scenario(path).workspace.polygon.symmetric_difference(box(0.1, 0.1, 6.1, 4.1)).area < 1e-9


REFUSED = {
    "rings too": ({"file": "hall.svg", "outer": [[0, 0], [1, 0], [1, 1]]}, "workspace.outer"),
    "neither": ({"holes": []}, "workspace.outer"),
    "settings without a file": ({"outer": [[0, 0], [6, 0], [6, 4]], "unit": "mm"}, "workspace.unit"),
    "gone": ({"file": "gone.svg"}, "workspace.file"),
    "unit": ({"file": "hall.svg", "unit": "parsec"}, "workspace.unit"),
    "tolerance": ({"file": "hall.svg", "tolerance": "much"}, "workspace.tolerance"),
}


@pytest.mark.parametrize(("workspace", "key"), REFUSED.values(), ids=REFUSED)
def test_what_does_not_fit_together_is_refused(tmp_path, workspace, key):
    path = named(tmp_path)
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), "workspace": workspace}))
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert caught.value.key == key


def test_a_start_outside_the_drawing_is_refused_with_the_drawing(tmp_path):
    with pytest.raises(FloorPlanError, match=r"hall.svg: start.object \(2.5, 2\): it stands in none"):
        load_scenario(named(tmp_path, scale=0.1))


def test_every_command_that_reads_the_floor_repeats_the_notes_of_its_reader(tmp_path):
    scenario, out = named(tmp_path), tmp_path / "out"
    drawing = (tmp_path / "hall.svg").read_text().replace("</svg>", "<text>Hall</text></svg>")
    (tmp_path / "hall.svg").write_text(drawing)
    notes = ["hall.svg: 1 <text> left out"]
    assert list(load_scenario(scenario).workspace.notes) == notes
    for words in (
        ["plan", scenario, "--out", out],
        ["verify", out / "plan.json", scenario],
        ["show", scenario, "--out", tmp_path / "room.png"],
    ):
        done = invoke(*words)
        assert (done.exit_code, done.output.count(f"Note: {notes[0]}")) == (0, 1), done.output
    given = ["--floor-plan", tmp_path / "hall.svg", "--unit", "m"]
    poses = ["--start", 2.0, 1.5, 0, "--goal", 3, 2, 0, "--length", 0.8]
    made = invoke("new", "mine", *given, *poses, "--out", tmp_path / "mine", "--json")
    assert made.exit_code == 0, made.output
    assert json.loads(made.stdout)["notes"] == notes
