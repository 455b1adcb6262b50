"""The figure sequence and the page: which files, what is in them, how large they are."""

from __future__ import annotations

import base64
import gzip
import json
import re
from math import pi

import numpy as np
import pytest
import umsgpack
from matplotlib.colors import to_rgba
from PIL import Image

from coop_drake.drawing.colours import CHANNEL, REACHED, UNDECIDED, UNREACHED
from coop_drake.watching import keyframes, scene_page, write_pictures
from coop_drake.watching.keyframes import on_turn
from coop_drake.watching.pictures import keyframe_figure, on_sheet
from tests.watching.rods import NARROW, WIDE, rod_recording


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


def test_the_sheet_shows_the_first_and_the_last_keyframe(shown):
    _, frames, _ = shown
    chosen = on_sheet(frames)
    assert (chosen[0], chosen[-1]) == (0, len(frames) - 1)
    assert len(chosen) <= 6


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
