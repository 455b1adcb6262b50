"""States and keyframes are what the exploration did: leaves, components, paths, layers and cuts."""

from __future__ import annotations

import base64
import gzip
import json
import re
from itertools import combinations, pairwise
from math import pi

import numpy as np
import pytest
import umsgpack
from matplotlib.colors import to_rgba
from PIL import Image
from shapely import LineString, union_all

from coop_drake import watching
from coop_drake.cli.results import ResultFolder
from coop_drake.drawing.colours import CHANNEL, REACHED, UNDECIDED, UNREACHED
from coop_drake.files import write_atomically
from coop_drake.geometry.minkowski import to_polygon
from coop_drake.planning.cells.exploration import (
    ChannelSearched,
    Exploration,
    ExplorationBegan,
    ExplorationEnded,
    ExplorationResumed,
    SliceAdded,
    SliceSplit,
)
from coop_drake.planning.cells.graph import Kind, holds, share_facet
from coop_drake.tree.component_tree import nearest_turn
from coop_drake.watching import keyframes, record_search, scene_page, search_states, write_pictures
from coop_drake.watching.keyframes import THETA, layers, on_turn, projection_of
from coop_drake.watching.pictures import cut, keyframe_figure
from coop_drake.watching.recording import BOXES
from tests.planning.test_search import rod_problem
from tests.support.cli import invoke
from tests.support.scenarios import ROOM, write_scenario
from tests.watching.rods import NARROW, WIDE, jointed_rod, rod_recording


@pytest.fixture(scope="module")
def found():
    recorded = rod_recording(WIDE)
    return recorded, keyframes(recorded, 12)


@pytest.fixture(scope="module")
def apart():
    recorded = rod_recording(NARROW)
    return recorded, keyframes(recorded, 12)


def area(section):
    return section.area()


def test_a_proof_shows_two_parts_that_never_touch_with_start_and_goal_in_different_ones(apart):
    recorded, frames = apart
    parts = frames[-1].components
    assert all(frame.components is None for frame in frames[:-1])
    start, goal = recorded.start_of(()), recorded.goal_of(())

    def members(end, part):
        return [
            leaf
            for leaf, region in part
            if holds(leaf.intervals, [float(end[2])], (True,)) and region.holds(end[:2])
        ]

    assert members(start, parts.reached)
    assert not members(start, parts.others)
    assert members(goal, parts.others)
    assert not members(goal, parts.reached)
    for leaf, region in parts.reached:
        for other, beyond in parts.others:
            neighbours = leaf.slice != other.slice and share_facet(leaf.intervals, other.intervals, (True,))
            assert not (neighbours and region.meets(beyond))
    mixed = sum(len(leaf.regions(Kind.MIXED)) for leaf in frames[-1].state.leaves.values())
    assert len(parts.reached) + len(parts.others) == mixed


def test_the_line_runs_from_start_to_goal_inside_the_cells_of_the_channel(found):
    recorded, frames = found
    frame = frames[-1]
    assert frame.headline.startswith("Found")
    path, channel = frame.path, frame.state.channel
    assert [piece.kind for piece in path] == [cell.kind for cell in channel]
    np.testing.assert_array_equal(path[0].positions[0], recorded.problem.start[:2])
    np.testing.assert_array_equal(path[-1].positions[-1], recorded.problem.goal_pose[:2])
    assert nearest_turn(path[-1].angles[-1, 0] - recorded.problem.goal_pose[2]) == pytest.approx(0.0)
    for before, after in pairwise(path):
        np.testing.assert_array_equal(before.positions[-1], after.positions[0])
        np.testing.assert_allclose(before.angles[-1], after.angles[0], rtol=0, atol=1e-12)
    for piece, cell in zip(path, channel, strict=True):
        # Outlines are straightened by a centimetre before lines are drawn round their corners.
        assert to_polygon(cell.region.section).buffer(0.011).covers(LineString(piece.positions))
        for theta in piece.angles[:, 0]:
            assert holds(cell.intervals, [theta], (True,))


def test_projections_are_the_unions_of_the_cells_and_do_not_overlap(found):
    _, frames = found
    leaves = list(frames[-1].state.leaves.values())
    projection = projection_of(leaves)
    for kinds, section in (
        ((Kind.FREE,), projection.free),
        ((Kind.FREE, Kind.GUIDE), projection.free + projection.guide),
        ((Kind.FREE, Kind.GUIDE, Kind.MIXED), projection.free + projection.guide + projection.mixed),
    ):
        exact = union_all(
            [to_polygon(r.section) for leaf in leaves for kind in kinds for r in leaf.regions(kind)]
        )
        assert area(section) == pytest.approx(exact.area, abs=0.01 * exact.length)
    for first, second in combinations((projection.free, projection.guide, projection.mixed), 2):
        assert area(first ^ second) == pytest.approx(0.0, abs=1e-6)


def test_layers_fill_the_turn_and_hold_what_meets_them(found):
    _, frames = found
    leaves = frames[len(frames) // 2].state.leaves.values()
    stacked = layers((leaf.intervals[0], leaf) for leaf in leaves)
    assert (stacked[0][0][0], stacked[-1][0][1]) == pytest.approx(THETA)
    for (below, _), (above, _) in pairwise(stacked):
        assert below[1] == pytest.approx(above[0], abs=1e-9)
    for (lower, upper), met in stacked:
        middle = 0.5 * (lower + upper)
        assert {leaf.slice for leaf in met} == {
            leaf.slice for leaf in leaves if any(a < middle < b for a, b in on_turn(leaf.intervals[0]))
        }


def test_a_cut_tiles_theta_and_the_joint_without_gap_or_overlap():
    recorded = record_search(jointed_rod(), "cells")
    for frame in keyframes(recorded, 8):
        tiles = cut(frame.state.leaves.values(), 1, frame.cut_at)
        total = sum((b - a) * (d - c) for (a, b), (c, d) in (leaf.intervals for leaf in tiles))
        assert total == pytest.approx(2 * pi * 2.0)
        strips = cut(frame.state.leaves.values(), 0, frame.cut_at)
        assert sum(leaf.intervals[0][1] - leaf.intervals[0][0] for leaf in strips) == pytest.approx(2 * pi)


def test_the_papers_algorithms_and_the_whole_portfolio_can_be_watched():
    printed = keyframes(rod_recording(WIDE, "paper"), 6)
    assert printed[0].state.slices < printed[-1].state.slices
    assert printed[-1].state.verdict in {"found", "below resolution", "budget spent"}
    boxes = keyframes(rod_recording(0.6, "portfolio"), 500)
    laying = [frame for frame in boxes if frame.state.question == BOXES]
    assert len(laying) > 2
    for laid, frame in enumerate(laying):
        assert all(leaf.free_fraction == 1.0 for leaf in frame.state.leaves.values())
        line = LineString(np.concatenate([piece.positions for piece in frame.path] or [np.zeros((2, 2))]))
        free = union_all([to_polygon(cell.region.section) for cell in frame.state.channel])
        assert laid == 0 or free.buffer(0.011).covers(line)
    assert boxes[-1].headline.startswith("Found")
    assert all(cell.kind is Kind.FREE for cell in boxes[-1].state.channel)
    refuted = keyframes(rod_recording(NARROW, "portfolio"), 6)
    assert refuted[-1].state.verdict == "infeasible"


@pytest.mark.parametrize("corridor", [WIDE, NARROW])
def test_events_replayed_give_the_leaves_cells_and_channel_of_the_exploration(corridor):
    problem, events = rod_problem(corridor), []
    exploration = Exploration(problem, watch=events.append)
    outcome = exploration.run(500)
    last = search_states(events, 7)[-1]
    assert sorted(last.leaves) == exploration.slices.leaves()
    for index, leaf in last.leaves.items():
        assert leaf.intervals == exploration.slices.all[index].intervals
        assert [cell.region for cell in leaf.cells] == [
            cell.region for cell in exploration.graph.by_slice[index]
        ]
    cells = [cell for leaf in last.leaves for cell in exploration.graph.by_slice[leaf]]
    for kind in (Kind.FREE, Kind.MIXED):
        assert last.count(kind) == sum(cell.kind is kind for cell in cells)
    assert [cell.region for cell in last.channel] == [cell.region for cell in outcome.path]
    assert last.cost == sum(cell.weight for cell in outcome.path)
    assert (last.slices, last.verdict) == (outcome.slices, outcome.verdict.value)


@pytest.mark.parametrize("most", [2, 3, 10, 10_000])
def test_no_more_states_than_asked_for_the_last_one_the_verdict_no_split_lost(most):
    recorded = rod_recording().events
    found = search_states(recorded, most)
    assert 2 <= len(found) <= most
    assert found[-1].verdict == "found"
    assert all(state.verdict is None for state in found[:-1])
    slices = [state.slices for state in found]
    assert slices == sorted(slices)
    halved = [(event.slice, event.axis) for event in recorded if isinstance(event, SliceSplit)]
    assert [(leaf.slice, axis) for state in found for leaf, axis in state.splits] == halved
    assert len(found[-1].history) == sum(isinstance(event, ChannelSearched) for event in recorded)


def test_a_single_keyframe_is_refused():
    with pytest.raises(ValueError, match="2 keyframes or more, got 1"):
        search_states([], 1)


def test_explorations_that_take_turns_are_kept_apart():
    events = [
        ExplorationBegan("first", (0,)),
        SliceAdded(0, ((0.0, 1.0),), ()),
        ExplorationEnded("budget spent", 1),
        ExplorationBegan("second", ()),
        SliceAdded(0, ((2.0, 3.0),), ()),
        ExplorationEnded("budget spent", 1),
        ExplorationResumed("first"),
        SliceSplit(0, 0),
        SliceAdded(1, ((0.0, 0.5),), ()),
        SliceAdded(2, ((0.5, 1.0),), ()),
        ExplorationEnded("infeasible", 3),
    ]
    found = search_states(events, 50)
    assert [state.question for state in found] == [*["first"] * 2, *["second"] * 2, *["first"] * 2]
    middle = next(state for state in reversed(found) if state.question == "second")
    assert {leaf.intervals for leaf in middle.leaves.values()} == {((2.0, 3.0),)}
    assert (middle.robots, middle.verdict) == ((), "budget spent")
    last = found[-1]
    assert (last.question, last.robots, last.slices, last.verdict) == ("first", (0,), 3, "infeasible")
    assert sorted(last.leaves) == [1, 2]
    assert [state.question for state in search_states(events, 3)] == ["first", "second", "first"]


# The figure sequence and the page: which files, what is in them, how large they are.


def commands(page):
    """The commands that a page gives to Meshcat's viewer."""
    (packed,) = re.findall(r'atob\("([A-Za-z0-9+/=]+)"\)', page)
    (lengths,) = re.findall(r"for \(const length of (\[[0-9, ]*\])\)", page)
    plain, start, decoded = gzip.decompress(base64.b64decode(packed)), 0, []
    for length in json.loads(lengths):
        decoded.append(umsgpack.unpackb(plain[start : start + length]))
        start += length
    assert start == len(plain)
    return decoded


@pytest.fixture(scope="module")
def shown():
    recorded = rod_recording(WIDE)
    frames = keyframes(recorded, 5)
    return recorded, frames, scene_page(recorded, frames)


def test_one_picture_a_keyframe_a_sheet_and_a_moving_picture(shown, tmp_path):
    recorded, frames, _ = shown
    written = write_pictures(recorded, frames, tmp_path)
    assert [path.name for path in written] == [
        *(f"think_{number:04d}.png" for number in range(1, len(frames) + 1)),
        "think.png",
        "think.gif",
    ]
    assert sorted(tmp_path.iterdir()) == sorted(written)
    for path in written[:-1]:
        with Image.open(path) as image:
            assert np.ptp(np.asarray(image.convert("L"))) > 100
    with Image.open(tmp_path / "think.gif") as moving:
        assert moving.n_frames == len(frames)
    assert (tmp_path / "think.gif").stat().st_size < 6e6


def test_the_path_through_the_angles_shows_what_is_proved_as_the_one_on_the_floor_does(shown):
    recorded, frames, _ = shown
    for frame in (one for one in frames if one.path):
        floor, angles, *_ = keyframe_figure(recorded, frame, frame.state.history).axes
        of_floor = {line.get_color() for line in floor.lines}
        assert {line.get_color() for line in angles.lines} in (of_floor, set())
    assert CHANNEL in of_floor


def test_the_last_picture_of_a_proof_shows_the_two_parts_in_two_colours():
    recorded = rod_recording(NARROW)
    *_, last = keyframes(recorded, 3)
    figure = keyframe_figure(recorded, last, last.state.history)
    fills = {tuple(patch.get_facecolor()[:3]) for patch in figure.axes[0].patches}
    assert {to_rgba(REACHED)[:3], to_rgba(UNREACHED)[:3]} <= fills
    assert to_rgba(UNDECIDED)[:3] not in fills
    assert figure.texts[0].get_text().startswith("Infeasible, proved")


def objects(page):
    """The paths of what a page shows."""
    return {one["path"].removeprefix("/think/") for one in commands(page) if one["type"] == "set_object"}


ENDS = {f"{end}/{part}" for end in ("start", "goal") for part in ("footprint", "pole")}
SURROUNDINGS = {"floor", "walls", "theta", *ENDS}


def test_the_page_shows_the_last_channel_and_the_way_through_it(shown):
    recorded, frames, page = shown
    assert objects(page) == SURROUNDINGS | {"cells/proved", "way/proved"}
    assert frames[-1].headline in page
    earlier = next(k for k, frame in enumerate(frames) if frame.state.channel)
    before = objects(scene_page(recorded, frames[: earlier + 1]))
    assert {"cells/undecided", "way/undecided"} <= before


def test_cells_are_as_high_as_their_intervals_of_theta(shown):
    _, frames, page = shown
    (cells,) = [one for one in commands(page) if one.get("path") == "/think/cells/proved"]
    (geometry,) = cells["object"]["geometries"]
    heights = np.frombuffer(geometry["data"]["attributes"]["position"]["array"].data, np.float32)[2::3]
    lower, upper = np.transpose(
        [part for cell in frames[-1].state.channel for part in on_turn(cell.intervals[0])]
    )
    assert 0.5 <= heights.min() == pytest.approx(0.5 + 6.0 * (lower.min() + pi / 4) / (2 * pi), abs=0.1)
    assert heights.max() == pytest.approx(0.5 + 6.0 * (upper.max() + pi / 4) / (2 * pi), abs=0.1)


def test_the_scene_of_a_proof_shows_the_two_components():
    recorded = rod_recording(NARROW)
    page = scene_page(recorded, keyframes(recorded, 3))
    assert {"reached", "others"} <= objects(page)
    assert "cannot be reached" in page


def test_the_page_is_small_needs_no_network_and_repeats(shown):
    recorded, frames, page = shown
    assert len(page) < 6e6
    fetched = re.findall(r"""<(?:script|cell|img|iframe)\b[^>]*?\b(?:src|href)=["']?([^"'>\s]+)""", page)
    assert all(address.startswith("data:") for address in fetched)
    assert page == scene_page(recorded, frames)


# coop-drake watch: files, answers, exit codes, and no half recordings.


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


def test_the_exit_code_says_that_there_is_no_path(tmp_path, monkeypatch):
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
    result = invoke("watch", path, "--output", tmp_path / "gap", "--frames", 2, "-q")
    assert result.exit_code == 3, result.stderr


@pytest.mark.parametrize(
    ("path", "arguments", "said"),
    [
        (None, ["--frames", "1"], "--frames"),
        (None, ["--frames", "many"], "--frames"),
        (None, ["--strategy", "magic"], "--strategy"),
        ("none.scenario.yaml", [], "none.scenario.yaml"),
    ],
)
def test_a_mistake_is_answered_with_what_is_allowed_and_leaves_nothing(room, tmp_path, path, arguments, said):
    result = invoke("watch", path or room, "--output", tmp_path / "out", *arguments)
    assert result.exit_code == 2
    assert said in result.stderr
    assert not (tmp_path / "out").exists()


def test_an_interruption_leaves_whole_files_only(room, tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("coop_drake.watching.scene.scene_page", interrupted)
    result = invoke("watch", room, "--output", tmp_path, "--frames", 2)
    assert result.exit_code == 130
    written = {path.name for path in tmp_path.iterdir()}
    pictures = {"think_0001.png", "think_0002.png", "think.png", "think.gif"}
    assert written == {".coop_drake_results.json", *pictures}
    for name in pictures:
        with Image.open(tmp_path / name) as image:
            image.load()
