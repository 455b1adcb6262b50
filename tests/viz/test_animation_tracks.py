"""Few key frames, between which straight lines stay within the tolerance."""

import numpy as np
import pytest

from coop_drake.viz.recording import kept_frames

FRAMES = np.linspace(0.0, 1.0, 400)


def between(values, kept):
    frames = np.arange(len(values))
    return np.column_stack([np.interp(frames, kept, column[kept]) for column in values.T])


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3])
def test_straight_lines_between_kept_frames_meet_all_frames(tolerance):
    values = np.column_stack(
        [np.sin(20.0 * FRAMES), np.abs(FRAMES - 0.4), np.random.default_rng(1).random(400)]
    )
    kept = kept_frames(values, tolerance, longest=400)
    assert np.abs(between(values, kept) - values).max() <= tolerance


def test_a_straight_line_needs_its_ends_only():
    assert kept_frames(FRAMES[:, None], 1e-9, longest=400) == [0, 399]


def test_a_jump_is_kept_where_it_is():
    values = np.where(FRAMES > 0.5, 1.0, 0.0)[:, None]
    assert kept_frames(values, 0.01, longest=400) == [0, 199, 200, 399]


def test_no_two_kept_frames_are_further_apart_than_allowed():
    assert kept_frames(np.zeros((100, 1)), 1.0, longest=30) == [0, 30, 60, 90, 99]


def test_a_single_frame_is_its_own_key_frame():
    assert kept_frames(np.zeros((1, 3)), 1.0, longest=5) == [0]
