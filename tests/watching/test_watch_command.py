"""coop-drake watch: files, answers, exit codes, and no half recordings."""

from __future__ import annotations

import json

import pytest

from coop_drake import watching
from coop_drake.cli.results import ResultFolder
from coop_drake.files import write_atomically
from tests.support.cli import invoke
from tests.support.scenarios import ROOM, write_scenario


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("scenario") / "room.scenario.yaml")


def test_a_recording_leaves_pictures_and_a_page_and_none_of_an_older_one(room, tmp_path):
    ResultFolder(tmp_path).begin("search")
    (tmp_path / "think_0099.png").write_bytes(b"of an older recording")
    (tmp_path / "notes.txt").write_text("not ours")
    result = invoke("watch", room, "--output", tmp_path, "--frames", 3, "--json")
    assert result.exit_code == 0, result.stderr
    facts = json.loads(result.stdout)
    assert (facts["answer"], facts["frames"]) == ("found", 3)
    names = [".coop_drake_results.json", "notes.txt", "think.gif", "think.html", "think.png"]
    pictures = [f"think_{number:04d}.png" for number in (1, 2, 3)]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names + pictures)
    assert facts["bytes"] == {name: (tmp_path / name).stat().st_size for name in facts["bytes"]}
    assert facts["bytes"].keys() == {*pictures, *names[2:]}


def test_the_exit_code_says_that_there_is_no_path_and_a_margin_proves_nothing(tmp_path, monkeypatch):
    # The files are tested above.
    monkeypatch.setattr(watching, "write_pictures", lambda recording, frames, directory, progress: [])
    monkeypatch.setattr(watching, "write_scene", lambda recording, frames, path: write_atomically(path, b""))
    below, above = [[4, 0], [4, 1.8], [5, 1.8], [5, 0]], [[5, 4], [5, 2.2], [4, 2.2], [4, 4]]
    outer = [[0, 0], *below, [9, 0], [9, 4], *above, [0, 4]]
    path = write_scenario(
        tmp_path / "gap.scenario.yaml",
        workspace={"outer": outer},
        start={"object": {"x": 2.0, "y": 2.0, "theta": 0.0}, "joints": ROOM["start"]["joints"]},
        goal={"object": {"x": 7.0, "y": 2.0, "theta": 0.0}},
    )
    for margin, code in (("0", 3), ("0.05", 4)):
        result = invoke("watch", path, "--output", tmp_path / margin, "--frames", 2, "--margin", margin, "-q")
        assert result.exit_code == code, result.stderr


@pytest.mark.parametrize(
    ("path", "arguments", "said"),
    [
        (None, ["--frames", "1"], "--frames"),
        (None, ["--frames", "many"], "--frames"),
        (None, ["--margin", "-0.1"], "--margin"),
        (None, ["--margin", "nan"], "--margin"),
        (None, ["--margin", "inf"], "inf"),
        (None, ["--strategy", "magic"], "--strategy"),
        ("none.scenario.yaml", [], "none.scenario.yaml"),
    ],
)
def test_a_mistake_is_answered_with_what_is_allowed_and_leaves_nothing(room, tmp_path, path, arguments, said):
    result = invoke("watch", path or room, "--output", tmp_path / "out", *arguments)
    assert result.exit_code == 2
    assert said in result.stderr
    assert not (tmp_path / "out").exists()
