"""The command new: what it writes is read, planned and carried out as it is; nothing is overwritten."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from coop_drake.answers import Found
from coop_drake.cli import app, new
from coop_drake.cli.task import read_task
from coop_drake.planning.planner import plan
from coop_drake.scenario import load_scenario
from coop_drake.tree.component_tree import PlanarPose
from tests.support.floor_plan_files import write_svg


def call(*arguments, **more):
    return CliRunner().invoke(app, ["new", *map(str, arguments)], **more)


@pytest.mark.slow
@pytest.mark.parametrize(
    "flags",
    [
        [],
        ["--robots", 3, "--arm", "0.3,0.2,0.2"],
        ["--robots", 4, "--arm", "0.5", "--base-radius", 0.2],
        ["--robots", 6],
    ],
    ids=["two", "three with elbows", "four without joints", "six"],
)
def test_a_new_scenario_has_a_plan(tmp_path, flags):
    done = call("mine", *flags, "--out", tmp_path / "mine", "--json")
    assert done.exit_code == 0, done.output
    scenario = json.loads(done.stdout)["scenario"]
    task = read_task(tmp_path / "mine" / "mine.scenario.yaml")
    assert scenario == str(task.scenario.path)
    found = plan(task.problem, task.scenario.gain_sets["scheduled"], gain_set_name="scheduled")
    assert isinstance(found, Found)
    assert sorted(path.name for path in (tmp_path / "mine").iterdir()) == [
        "mine.scenario.yaml",
        "object.sdf",
        "robot.sdf",
    ]
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]


def test_the_models_have_the_sizes_that_were_asked_for(tmp_path):
    sizes = ["--arm", "0.3,0.25,0.2", "--base-radius", 0.22, "--length", 1.2, "--width", 0.4]
    call("mine", *sizes, "--out", tmp_path)
    tree = read_task(tmp_path / "mine.scenario.yaml", None).problem.tree
    bodies = {body.name: body for component in tree.components for body in component.bodies}
    assert bodies["object::body"].shapes[0].vertices.max(axis=0) == pytest.approx((0.6, 0.2))
    assert bodies["robot_0::base"].shapes[0].radius == pytest.approx(0.22)
    straight = tree.poses([0.0] * (3 + 4))
    bases = [
        (pose @ PlanarPose(*body.shapes[0].vertices[0])).x
        for pose, component in zip(straight, tree.components, strict=True)
        for body in component.bodies
        if body.name.endswith("base")
    ]
    assert sorted(bases) == pytest.approx([-1.35, 1.35])  # Half the object and three links.


def test_a_floor_plan_takes_the_place_of_the_rooms(tmp_path):
    layers = (("walls", '<rect width="10" height="6"/>'), ("desks", '<rect x="4" width="1" height="6"/>'))
    groups = [f'<g inkscape:groupmode="layer" inkscape:label="{name}">{body}</g>' for name, body in layers]
    write_svg(tmp_path, "".join(groups))
    poses = ["--start", 2, 2, 0, "--goal", 8, 4, 1.57]
    drawing = ["--floor-plan", tmp_path / "hall.svg", "--unit", "cm", "--scale", 100, "--layer", "walls"]
    done = call("mine", *drawing, *poses, "--out", tmp_path / "deep" / "mine")
    assert done.exit_code == 0, done.output
    path = tmp_path / "deep" / "mine" / "mine.scenario.yaml"
    assert 'file: "../../hall.svg"' in path.read_text()
    assert load_scenario(path).workspace.polygon.area == pytest.approx(60.0)


REFUSED = {
    "one robot": (["--robots", 1], "--robots: 1 is not allowed; expected two to six"),
    "no arm": (["--arm", "long"], "is no list of lengths"),
    "flat": (["--width", 0], "--width: 0.0 is not allowed"),
    "no start": (["--floor-plan", "hall.svg"], "--start: None is not allowed; expected X Y THETA"),
    "unit alone": (["--unit", "m"], "--unit is for a floor plan"),
    "scale alone": (["--scale", 50], "--scale is for a floor plan"),
    "arm in a wall at the goal": (["--goal", 3.2, 1.0, 0], "mine/mine.scenario.yaml: goal.object: "),
    "layer alone": (["--layer", "walls"], "--layer is for a floor plan"),
    "no such plan": (
        ["--floor-plan", "hall.svg", "--start", 1, 1, 0, "--goal", 2, 1, 0],
        "/hall.svg' is not allowed; expected a file that exists",
    ),
    "in a wall": (["--start", 0, 0, 0], "mine/mine.scenario.yaml: start: "),
}


@pytest.mark.parametrize(("flags", "message"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_meant_leaves_nothing_behind(tmp_path, monkeypatch, flags, message):
    monkeypatch.chdir(tmp_path)
    done = call("mine", *flags)
    assert done.exit_code == 2
    assert message in " ".join(done.output.split()).replace("│ ", "")
    assert list(tmp_path.iterdir()) == []


def test_files_are_replaced_only_by_force(tmp_path):
    (tmp_path / "robot.sdf").write_text("mine")
    done = call("mine", "--out", tmp_path)
    assert done.exit_code == 2
    assert "--force" in done.output
    assert (tmp_path / "robot.sdf").read_text() == "mine"
    assert call("mine", "--out", tmp_path, "--force").exit_code == 0
    assert "<sdf" in (tmp_path / "robot.sdf").read_text()


def test_it_asks_at_a_terminal_only_for_what_no_flag_says(tmp_path, monkeypatch):
    class Terminal:
        @staticmethod
        def isatty():
            return True

    monkeypatch.setattr(new.sys, "stdin", Terminal)
    monkeypatch.setattr(new.sys, "stdout", Terminal)
    asked = []
    monkeypatch.setattr(new.typer, "prompt", lambda text, default, type: asked.append(text) or default)
    flags = dict.fromkeys(["robots", "arm", "base_radius", "length", "width"])
    assert new._asked({**flags, "robots": 3}) == {
        "robots": 3,
        "arm": "0.35,0.4",
        "base_radius": 0.25,
        "length": 0.8,
        "width": 0.5,
    }
    assert [text.split()[0] for text in asked] == ["Lengths", "Radius", "Length", "Width"]
