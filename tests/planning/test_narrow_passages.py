"""Paths for a larger floor, repaired until they fit the original floor."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from shapely import Point

from benchmarks.planner.family import corridor_problem
from coop_drake.planning import Channel, find_channel, sampled_search
from coop_drake.planning.sampled_search import NarrowSearch
from coop_drake.planning.sampling.narrow_passages import (
    amount_needed,
    are_free,
    ease_less,
    repaired,
    widened_floor,
)
from coop_drake.planning.sampling.sampler import Sampler, SubsystemHierarchy
from tests.planning.test_search import rod_problem
from tests.support.cases import transport
from tests.support.soundness import assert_channel_is_sound

THROUGH = np.array([[-2.5, 0.0, 1.5], [-2.5, 0.0, 0.0], [2.5, 0.0, 0.0], [2.5, 0.0, 1.5]])


def tilted(angle: float = 0.05) -> np.ndarray:
    """A path of the rod through the corridor that holds it at an angle inside."""
    paths = THROUGH.copy()
    paths[1:3, 2] = angle
    return np.concatenate([a + (b - a) * np.linspace(0, 1, 41)[:, None] for a, b in pairwise(paths)])


def test_the_amount_that_a_path_needs_is_what_its_tightest_sample_sticks_out():
    problem = rod_problem(0.15)

    def eased(amount):
        return replace(problem, workspace=problem.workspace.buffer(amount, join_style="mitre"))

    path = tilted(0.0)
    needed, worst = amount_needed(eased, path, 0.1)
    assert needed == pytest.approx(0.025, abs=2e-4)
    assert abs(path[worst, 0]) < 1.6
    assert are_free(eased(needed), path).all()
    assert not are_free(eased(needed - 5e-4), path).all()
    closer, less = ease_less(eased, tilted(), 0.1)
    assert less < amount_needed(eased, tilted(), 0.1)[0]
    assert less >= 0.025 - 2e-4
    assert np.array_equal(closer[[0, -1]], tilted()[[0, -1]])


@pytest.mark.parametrize(("corridor", "fits"), [(0.21, True), (0.19, False)])
def test_a_path_is_repaired_only_where_it_fits(corridor, fits):
    problem = rod_problem(corridor)
    path, short = repaired(problem, tilted(), 0.06)
    assert (short <= 0.0) == fits
    assert are_free(problem, path).all() == fits


def test_a_wider_floor_holds_the_floor():
    floor = rod_problem(0.2).workspace
    assert widened_floor(floor, 0.05).contains(floor)
    assert widened_floor(floor, 0.05).contains(Point(0.0, 0.14))


@pytest.mark.parametrize(("width", "sampled_joints"), [(0.4, 0), (0.9, 2)])
def test_the_team_is_sampled_only_where_the_object_alone_almost_fits(monkeypatch, width, sampled_joints):
    """Walls are 0.1 m further back for samples: there the object, 0.5 m wide, passes at 0.4 m, too."""
    problem, sampled = corridor_problem(width), []
    inner = Sampler._connect

    def connect(self, subsystem, *rest):
        sampled.append(len(subsystem.joints))
        return inner(self, subsystem, *rest)

    monkeypatch.setattr(Sampler, "_connect", connect)
    monkeypatch.setattr(sampled_search, "NARROW_SAMPLES", 4_000)
    search = NarrowSearch(problem, SubsystemHierarchy(problem), lambda path, smallest: None)
    tried = search.tries(1, None, object_first=True)[0]()
    assert max(sampled) == sampled_joints
    assert (tried.path is not None) == (sampled_joints > 0)
    if tried.path is not None:
        assert are_free(problem, tried.path).all() == (tried.short <= 0.0)


@pytest.mark.slow
@pytest.mark.no_cover
def test_a_corridor_too_narrow_for_samples_is_found_and_sound():
    problem = transport(0.79)
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert_channel_is_sound(problem, channel)
