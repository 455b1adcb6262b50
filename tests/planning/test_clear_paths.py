"""Paths with clearance: moved from the walls, measured as shapely measures them, and covered on request."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon

from coop_drake.errors import GeometryError
from coop_drake.planning import sampled_search
from coop_drake.planning.channel import Channel, CoveredPath
from coop_drake.planning.questions import exact_footprint
from coop_drake.planning.sampled_search import SampledSearch
from coop_drake.planning.sampling.band import (
    estimated_duration,
    margins_to_try,
    moved_from_obstacles,
    path_clearance,
)
from coop_drake.planning.search import find_channel, find_path
from tests.planning.test_search import rod_problem
from tests.support.free_positions import FreePositions

CORRIDOR = 0.6


@pytest.fixture(scope="module")
def problem():
    return rod_problem(CORRIDOR)


@pytest.fixture(scope="module")
def bent():
    """A path for the rod that turns late and passes close to a wall of the corridor."""
    y = 0.5 * CORRIDOR - 0.1 - 0.02
    return np.array(
        [[-2.5, 0, 1.5], [-1.7, y, 0.0], [1.7, y, 0.0], [2.5, 0, 1.5]],
        dtype=float,
    )


def clearance(problem, path):
    """Least distance of the exact footprint from the walls at many places of a path [m]."""
    places = np.linspace(0.0, len(path) - 1.0, 400)
    samples = np.array([np.interp(places, np.arange(len(path)), column) for column in path.T]).T
    walls = problem.workspace.boundary
    return min(walls.distance(exact_footprint(problem.tree, z)) for z in samples)


def test_the_clearance_is_what_shapely_measures(problem, bent):
    assert path_clearance(problem, bent, 1.0) == pytest.approx(clearance(problem, bent), abs=2e-3)
    assert path_clearance(problem, bent, 0.01) == 0.01


def test_a_start_near_a_wall_allows_clearance_elsewhere(problem):
    path = np.array([[-2.5, 0.48, 1.5], [-2.0, 0.0, 0.0], [-1.8, 0.0, 0.0]])
    near = replace(problem, start=path[0])
    assert clearance(near, path) < 0.03
    assert path_clearance(near, path, 0.15) > 0.05
    assert path_clearance(near, np.vstack((path, path[0])), 0.15) > 0.05


def test_a_path_is_moved_from_the_walls_and_stays_free(problem, bent):
    wide = moved_from_obstacles(problem, bent, 0.01)
    np.testing.assert_array_equal(wide[[0, -1]], bent[[0, -1]])
    assert clearance(problem, wide) > 3.0 * clearance(problem, bent)
    assert estimated_duration(problem, wide) < estimated_duration(problem, bent)
    for z in wide:
        assert FreePositions(problem.tree, problem.workspace, z[2:]).free(z[None, :2]).all()


def test_margins_fall_and_keep_to_what_is_asked(problem, bent):
    wide = moved_from_obstacles(problem, bent, 0.01)
    margins = list(margins_to_try(problem, wide))
    assert margins == sorted(margins, reverse=True)
    assert 0.0 < margins[-1] <= margins[0] <= problem.settings.margin
    unasked = replace(problem, settings=replace(problem.settings, margin=0.0))
    assert list(margins_to_try(unasked, wide)) == []


def test_polygons_are_made_where_they_are_asked_for(problem, monkeypatch):
    made = []
    inner = sampled_search.make_channel
    monkeypatch.setattr(sampled_search, "make_channel", lambda *given: made.append(given) or inner(*given))
    path, _ = find_path(problem)
    assert isinstance(path, CoveredPath)
    assert made == []
    assert path.margin > 0.0
    channel = path.channel()
    assert isinstance(channel, Channel)
    assert len(made) == 1
    assert channel.margin == path.margin
    for box in channel.boxes:
        assert isinstance(box.polygon, Polygon)
        assert box.polygon.covers(box.core)


def test_polygons_that_cannot_be_made_are_no_channel_and_no_proof(problem, monkeypatch):
    monkeypatch.setattr(SampledSearch, "_channel", lambda self, chain: None)
    path, _ = find_path(problem)
    with pytest.raises(GeometryError, match="cannot be computed"):
        path.channel()
    answer, _ = find_channel(problem)
    assert not isinstance(answer, Channel)
    assert not answer.proved
