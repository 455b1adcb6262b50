"""Maps kept on disk: the same to the last bit, never stale, never in the way."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from shapely import Point, box

from coop_drake.errors import FieldError
from coop_drake.harmonic_maps import HarmonicMap, MapStore, VelocityField
from tests.support import domains

TOLERANCE = 1e-7


@pytest.fixture
def store(tmp_path):
    return MapStore(tmp_path / "maps")


def same(one, other):
    """Whether two maps agree bit by bit in everything that can be asked of them."""
    points = domains.inside(one.region, 200)
    return (
        all(np.array_equal(a, b) for a, b in zip(one(points), other(points), strict=True))
        and np.array_equal(one.goal_image, other.goal_image)
        and np.array_equal(VelocityField(one)(points[0]), VelocityField(other)(points[0]))
        and one.region.equals_exact(other.region)
        and all(
            np.array_equal(getattr(one.accuracy, f.name), getattr(other.accuracy, f.name))
            for f in dataclasses.fields(one.accuracy)
        )
    )


@pytest.mark.parametrize(
    "question",
    [
        domains.u_corridor(),
        (box(0, 0, 3, 2).difference(box(1, 0.5, 1.5, 1)), Point(2.5, 1.5)),
        (box(0, 0, 3, 2), box(2, 0.5, 2.5, 1)),
        (box(0, 0, 3, 2), box(2.5, 0.5, 3, 1)),
    ],
    ids=["corridor", "hole", "goal region inside", "goal region on the outer ring"],
)
def test_a_map_that_was_kept_is_the_one_that_was_solved(store, question):
    solved = store.map_of(*question, tolerance=TOLERANCE)
    assert (store.found, len(store.files())) == (0, 1)
    read = MapStore(store.folder).map_of(*question, tolerance=TOLERANCE)
    assert same(read, solved)
    assert same(read, HarmonicMap(*question, tolerance=TOLERANCE))


def test_what_is_found_is_not_solved_again(store, monkeypatch):
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    monkeypatch.setattr("coop_drake.harmonic_maps.harmonic_map._solve", None)
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert store.found == 1


def test_another_question_is_another_map(store):
    domain, goal = domains.square()
    store.map_of(domain, goal, tolerance=TOLERANCE)
    store.map_of(domain, goal, tolerance=2 * TOLERANCE)
    store.map_of(domain, Point(0.3, np.nextafter(0.6, 1.0)), tolerance=TOLERANCE)
    store.map_of(box(0, 0, 1, np.nextafter(1.0, 2.0)), goal, tolerance=TOLERANCE)
    assert (store.found, len(store.files())) == (0, 4)


def test_other_code_is_another_map(store, monkeypatch):
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    monkeypatch.setattr("coop_drake.harmonic_maps.harmonic_map._code", lambda: b"later")
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert (store.found, len(store.files())) == (0, 2)


def flip(content):
    """Change one bit in the middle."""
    half = len(content) // 2
    return content[:half] + bytes([content[half] ^ 1]) + content[half + 1 :]


@pytest.mark.parametrize(
    "damage",
    [lambda content: content[:-100], lambda content: content[:200], lambda content: b"", flip],
    ids=["cut off", "almost nothing", "empty", "one bit"],
)
def test_a_damaged_file_is_replaced(store, damage):
    solved = store.map_of(*domains.square(), tolerance=TOLERANCE)
    (path,) = store.files()
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    assert same(store.map_of(*domains.square(), tolerance=TOLERANCE), solved)
    assert store.found == 0
    assert same(store.map_of(*domains.square(), tolerance=TOLERANCE), solved)
    assert store.found == 1


def test_a_file_under_the_name_of_another_question_is_not_believed(store):
    domain, goal = domains.square()
    store.map_of(domain, goal, tolerance=TOLERANCE)
    (first,) = store.files()
    store.map_of(domain, Point(0.5, 0.5), tolerance=TOLERANCE)
    (second,) = set(store.files()) - {first}
    second.write_bytes(first.read_bytes())
    assert store.map_of(domain, Point(0.5, 0.5), tolerance=TOLERANCE).goal.x == 0.5
    assert store.found == 0


def test_a_folder_that_cannot_be_written_keeps_nothing(tmp_path):
    (tmp_path / "maps").write_text("a file where the folder should be")
    store = MapStore(tmp_path / "maps")
    for _ in range(2):
        store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert (store.found, store.files(), store.size()) == (0, [], 0)


def test_writers_at_the_same_time_do_no_harm(store):
    with ThreadPoolExecutor(4) as pool:
        futures = [pool.submit(store.map_of, *domains.square(), tolerance=TOLERANCE) for _ in range(8)]
        maps = [future.result() for future in futures]
    assert all(same(other, maps[0]) for other in maps)
    assert [path.suffixes for path in store.folder.iterdir()] == [[".map", ".npz"]]


def test_a_map_that_fails_is_refused_every_time(store):
    for _ in range(2):
        with pytest.raises(FieldError):
            store.map_of(box(0, 0, 1, 1), Point(2, 2), tolerance=TOLERANCE)
    assert store.files() == []


def test_the_maps_not_used_for_longest_are_forgotten_first(store):
    sides = (1.0, 1.1, 1.2)
    for side in (*sides, sides[0]):  # the first one is used again
        store.map_of(box(0, 0, 1, side), Point(0.5, 0.5), tolerance=TOLERANCE)
    oldest, *others = store.files()
    MapStore(store.folder, limit=store.size() - 1).trim()
    assert store.files() == others
    store.map_of(box(0, 0, 1, sides[0]), Point(0.5, 0.5), tolerance=TOLERANCE)
    assert store.found == 2
    assert not oldest.exists()


def test_a_store_can_be_cleared(store):
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert store.size() > 0
    store.clear()
    assert store.files() == []
    store.clear()
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert store.found == 0
