import numpy as np
import pytest

from coop_drake.laws.measurements import random_words, uniform_pair, write_normals


@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        (
            (0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF),
            (0xFFFFFFFF, 0xFFFFFFFF),
            (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD),
        ),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_words_are_those_that_were_published(counter, key, expected):
    assert random_words(counter, key) == expected


def test_pairs_are_uniform_and_independent():
    pairs = np.array([uniform_pair(7, k) for k in range(4000)])
    counts, _, _ = np.histogram2d(*pairs.T, bins=5, range=[[0.0, 1.0]] * 2)
    assert np.abs(counts - 160).max() < 5 * np.sqrt(160)


def test_normals_have_the_moments_of_a_normal_distribution():
    drawn = np.empty((4000, 7))
    for k in range(len(drawn)):
        write_normals(3, k, drawn[k])
    np.testing.assert_allclose(drawn.mean(axis=0), 0.0, atol=0.08)
    np.testing.assert_allclose(np.cov(drawn.T), np.eye(7), atol=0.1)
    np.testing.assert_allclose((drawn**4).mean(axis=0), 3.0, atol=0.6)


def test_seed_and_number_decide_and_nothing_else():
    first, again, shorter, other = np.empty(5), np.empty(5), np.empty(3), np.empty(5)
    write_normals(1, 2**40, first)
    write_normals(1, 5, other)
    write_normals(1, 2**40, again)
    write_normals(1, 2**40, shorter)
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first[:3], shorter)
    assert not np.any(first == other)
    write_normals(2, 2**40, other)
    assert not np.any(first == other)
