"""Paths moved to the middle of their narrowest passages, and the distances that this is computed from."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.geometry.convex import following
from coop_drake.geometry.parts import polygon_rings
from coop_drake.planning.sampling.band import clearances
from coop_drake.planning.sampling.collision import grid_for_team
from coop_drake.planning.sampling.narrow_passages import are_free, body_contacts, centred, wall_contacts
from coop_drake.tree.team_arrays import team_arrays
from tests.planning.test_narrow_passages import tilted
from tests.planning.test_search import rod_problem
from tests.support.cases import case
from tests.support.trees import body_footprints


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
