"""Paths for a larger floor, repaired until they fit the original floor; the middle of narrow passages."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from shapely import Point

from benchmarks.planner.family import corridor_problem
from coop_drake.geometry.polygons import polygon_rings
from coop_drake.geometry.sweeps import following
from coop_drake.planning import Channel, find_channel, sampled_search
from coop_drake.planning.sampled_search import SampledSearch
from coop_drake.planning.sampling.band import clearances
from coop_drake.planning.sampling.collision import grid_for_team
from coop_drake.planning.sampling.narrow_passages import (
    amount_needed,
    are_free,
    body_contacts,
    centred,
    ease_less,
    repaired,
    wall_contacts,
    widened_floor,
)
from coop_drake.planning.sampling.sampler import Sampler
from coop_drake.tree.team_arrays import team_arrays
from tests.planning.test_search import rod_problem
from tests.support.cases import case, transport
from tests.support.soundness import assert_channel_is_sound
from tests.support.trees import body_footprints

# Paths for a larger floor, repaired until they fit the original floor.

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
    growth = sampled_search.FLOOR_GROWTHS[0]
    path = SampledSearch(problem)._on_larger_floor(True, True, 0, growth, None)
    assert max(sampled) == sampled_joints
    assert (len(path) > 0) == (sampled_joints > 0)
    if len(path) > 0:
        path, short = repaired(problem, path, growth)
        assert are_free(problem, path).all() == (short <= 0.0)


@pytest.mark.slow
@pytest.mark.no_cover
def test_a_corridor_too_narrow_for_samples_is_found_and_sound():
    problem = transport(0.79)
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert_channel_is_sound(problem, channel)


# Paths moved to the middle of their narrowest passages, and the distances that this is computed from.


def poses_near_walls(problem, count=40):
    """Free configurations of a team that are up to 0.1 m from a wall."""
    team, random = team_arrays(problem.tree), np.random.default_rng(3)
    low, high = problem.workspace.bounds[:2], problem.workspace.bounds[2:]
    joints = problem.tree.joint_lower, problem.tree.joint_upper
    drawn = random.uniform([*low, -3.0, *joints[0]], [*high, 3.0, *joints[1]], (40_000, 3 + len(joints[0])))
    clear = clearances(team, grid_for_team(problem.workspace, team), drawn, 0.2)
    near = drawn[(clear > 1e-3) & (clear < 0.1)]
    return near[are_free(problem, near)][:count]


def least(contacts, count):
    return np.array([contacts.distances[contacts.rows == k].min() for k in range(count)])


def test_the_nearest_contact_with_a_wall_has_the_clearance_and_its_change():
    problem = case("elbow")
    team, path = team_arrays(problem.tree), poses_near_walls(problem)
    assert len(path) == 40
    edges = np.concatenate([np.hstack((r, following(r))) for r in polygon_rings(problem.workspace)])
    grid = grid_for_team(problem.workspace, team)
    found = wall_contacts(team, path, edges, 0.15)
    np.testing.assert_allclose(least(found, len(path)), clearances(team, grid, path, 0.2), atol=1e-12)
    step = 1e-6 * np.random.default_rng(1).normal(size=path.shape)
    moved = wall_contacts(team, path + step, edges, 0.2)
    first = found.distances + np.einsum("md,md->m", found.gradients, step[found.rows])
    expected = np.array([first[found.rows == k].min() for k in range(len(path))])
    np.testing.assert_allclose(least(moved, len(path)), expected, atol=1e-10)


def test_the_nearest_contact_of_bodies_is_their_distance():
    problem = case("elbow")
    team, path = team_arrays(problem.tree), poses_near_walls(problem, 10)
    found = body_contacts(team, path, 5.0)
    for k, z in enumerate(path):
        bodies = body_footprints(problem.tree, z)
        apart = min(bodies[a].distance(bodies[b]) for a, b in problem.tree.collision_pairs)
        assert found.distances[found.rows == k].min() == pytest.approx(apart, abs=2e-3)  # Discs are polygons.


@pytest.mark.parametrize("corridor", [0.2016, 0.199])
def test_a_path_is_moved_to_the_middle_of_its_passage(corridor):
    problem = rod_problem(corridor)
    path, short = centred(problem, tilted(0.002), 0.002)
    assert short == pytest.approx(0.5 * (0.2 - corridor), abs=1e-5)
    easier = problem.workspace.buffer(short + 1e-9, join_style="mitre")
    assert are_free(replace(problem, workspace=easier), path).all()
    assert np.array_equal(path[[0, -1]], tilted()[[0, -1]])
