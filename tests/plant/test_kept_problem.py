"""What the models give is kept on disk, and read again only while no file that it came from has changed."""

import numpy as np
import pytest

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.problem import PlanningProblem
from coop_drake.plant import planning_problem
from coop_drake.plant.kept_problem import keep_problem, kept_problem
from coop_drake.scenario import load_scenario
from coop_drake.scenario.load import read_scenario
from tests.support.edited_scenario import MODELS, exchanged, write_edited

ROBOT = "package://coop_drake_models/long_blue.sdf"
MESH = "v 0 0 0\nv 0.1 0 0\nv 0 {y} 0\nv 0 0 0.1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
WITH_MESH = (
    "<collision name='tip'><pose>0.1 0 0.2 0 0 0</pose><geometry><mesh><uri>{uri}</uri></mesh></geometry>"
    "</collision>\n    <collision"
)
PACKAGE = "<package format='2'><name>mine</name></package>"


def keep(path, folder):
    scenario = load_scenario(path)
    problem = planning_problem(scenario)
    keep_problem(scenario, problem, folder)
    return problem


def kept(path, folder):
    return kept_problem(read_scenario(path), folder)


def write_team(folder, uri="tip.obj", address="parts/arm.sdf"):
    """The base scenario with a robot of its own, whose collision geometry has a mesh."""
    parts = folder / "parts"
    parts.mkdir()
    model = (MODELS / "long_blue.sdf").read_text()
    (parts / "arm.sdf").write_text(exchanged(model, ("<collision", WITH_MESH.format(uri=uri))))
    (parts / "tip.obj").write_text(MESH.format(y=0.1))
    return write_edited(folder, (ROBOT, address))


@pytest.mark.parametrize("name", ["base", "three", "elbow", "closed"])
def test_a_kept_problem_is_the_same_to_the_last_bit(name, tmp_path):
    path = MODELS / f"{name}.scenario.yaml"
    problem, again = keep(path, tmp_path), kept(path, tmp_path)
    assert again.tree.unchecked_pairs == problem.tree.unchecked_pairs
    with np.printoptions(floatmode="unique", threshold=10**6):
        for field in set(PlanningProblem.__dataclass_fields__) - {"tree"}:
            assert repr(getattr(again, field)) == repr(getattr(problem, field))
        assert repr(again.tree.components) == repr(problem.tree.components)


def test_a_problem_that_was_never_kept_is_not_known(tmp_path):
    assert kept(MODELS / "base.scenario.yaml", tmp_path / "cache") is None


@pytest.mark.parametrize("file", ["edited.scenario.yaml", "parts/arm.sdf", "parts/tip.obj"])
def test_an_edit_of_any_file_is_noticed(file, tmp_path):
    path = write_team(tmp_path)
    keep(path, tmp_path / "cache")
    assert kept(path, tmp_path / "cache") is not None
    with (tmp_path / file).open("a") as stream:
        stream.write("\n")
    assert kept(path, tmp_path / "cache") is None


def test_an_edited_mesh_gives_another_problem(tmp_path):
    path = write_team(tmp_path)
    before = problem_digest(keep(path, tmp_path / "cache"))
    (tmp_path / "parts" / "tip.obj").write_text(MESH.format(y=0.3))
    assert kept(path, tmp_path / "cache") is None
    after = problem_digest(keep(path, tmp_path / "cache"))
    assert after != before
    assert problem_digest(kept(path, tmp_path / "cache")) == after


def test_a_package_that_appears_nearer_is_noticed(tmp_path):
    (tmp_path / "package.xml").write_text(PACKAGE)
    inner = tmp_path / "inner"
    inner.mkdir()
    path = write_team(inner, "package://mine/inner/parts/tip.obj", "package://mine/inner/parts/arm.sdf")
    keep(path, tmp_path / "cache")
    assert kept(path, tmp_path / "cache") is not None
    (inner / "package.xml").write_text(PACKAGE)
    assert kept(path, tmp_path / "cache") is None


def test_a_mesh_in_a_package_is_followed(tmp_path):
    (tmp_path / "package.xml").write_text(PACKAGE)
    path = write_team(tmp_path, "package://mine/parts/tip.obj")
    keep(path, tmp_path / "cache")
    (tmp_path / "parts" / "tip.obj").write_text(MESH.format(y=0.2))
    assert kept(path, tmp_path / "cache") is None


def test_nested_directives_are_followed(tmp_path):
    nested = tmp_path / "arm.dmd.yaml"
    nested.write_text(f"directives:\n- add_model: {{name: robot_0, file: {ROBOT}}}\n")
    model = f"add_model: {{name: robot_0, file: {ROBOT}}}"
    path = write_edited(tmp_path, (model, "add_directives: {file: arm.dmd.yaml}"))
    keep(path, tmp_path / "cache")
    assert kept(path, tmp_path / "cache") is not None
    nested.write_text(nested.read_text().replace("long_blue", "long_orange"))
    assert kept(path, tmp_path / "cache") is None


@pytest.mark.parametrize("damage", [b"", b"{", b"[]", b"{}", b'{"digest": 3}', b"\xff\x00"])
def test_a_damaged_file_counts_as_missing(damage, tmp_path):
    path = MODELS / "base.scenario.yaml"
    keep(path, tmp_path)
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    file.write_bytes(damage)
    assert kept(path, tmp_path) is None
    file.write_bytes(whole.replace(b'"lower": ', b'"lower": 1'))
    assert kept(path, tmp_path) is None


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path):
    (tmp_path / "file").write_text("")
    keep(MODELS / "base.scenario.yaml", tmp_path / "file" / "cache")
