"""Random trees: the nearest nodes, and samples around a guide."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.planner.family import corridor_problem, crowd_problem
from coop_drake.answers import PlannerSettings
from coop_drake.planning.channel import Channel, middle_of
from coop_drake.planning.questions import marginal_workspace
from coop_drake.planning.sampled_search import SampledSearch
from coop_drake.planning.sampling.collision import grid_for_team, is_free
from coop_drake.planning.sampling.narrow_passages import are_free
from coop_drake.planning.sampling.sampler import Sampler, SubsystemHierarchy
from coop_drake.planning.sampling.trees import SampledRegion, add, draw, empty_tree, nearest
from coop_drake.planning.search import find_channel
from coop_drake.tree.team_arrays import team_arrays

# The grid of a random tree finds the nearest node, as comparing with all nodes does.

LOWER, UPPER = np.array([-1.0, 2.0, -np.pi, -1.5]), np.array([9.0, 6.0, np.pi, 1.5])


@pytest.mark.parametrize("circles", [[2], [2, 3]], ids=["joint with limits", "joint without limits"])
@pytest.mark.parametrize("spread", [0.05, 1.0], ids=["crowded", "all over the floor"])
def test_the_nearest_node_is_found(spread, circles):
    random = np.random.default_rng(3)
    scale = np.array([1.0, 1.0, 1.3, 0.4])
    middle, size = 0.5 * (LOWER + UPPER), 1.2 * (UPPER - LOWER)  # Some nodes are beyond the floor.
    nodes = middle + spread * (random.random((400, 4)) - 0.5) * size
    nodes[:, circles] *= 3.0  # Circular axes are not limited to one turn.
    tree = empty_tree(len(nodes), LOWER, UPPER, np.isin(np.arange(4), circles))
    for k, z in enumerate(nodes):
        add(tree, k, z, -1)
        sample = middle + 1.3 * (random.random(4) - 0.5) * size
        d = sample - nodes[: k + 1]
        d[:, circles] -= 2.0 * np.pi * np.round(d[:, circles] / (2.0 * np.pi))
        assert nearest(tree, sample, scale) == np.argmin(((d * scale) ** 2).sum(axis=1))


# Samples around a guide: component by component they are free far more often, and stay within the region.

SAMPLES = 400


@pytest.fixture(scope="module")
def problem():
    return crowd_problem(4)


def test_samples_of_a_large_team_are_free_more_often_component_by_component(problem):
    team = team_arrays(problem.tree)
    grid = grid_for_team(problem.workspace, team)
    lower = np.array([0.0, 0.0, -np.pi, *problem.tree.joint_lower])
    upper = np.array([14.0, 20.0, np.pi, *problem.tree.joint_upper])
    circular = np.array([False, False, *problem.tree.circular])
    spread = np.array([0.3, 0.3, *[0.0] * (len(lower) - 2)])
    guide = problem.start[None, :].astype(float)
    uniforms = np.random.default_rng(3).random((SAMPLES, 2 + len(lower)))
    free = {}
    for tries in (1, 12):
        region = SampledRegion(guide, spread, lower, upper, circular, 0, tries)
        samples, poses = np.empty((SAMPLES, len(lower))), np.empty((len(team.links), 5))
        for u, sample in zip(uniforms, samples, strict=True):
            draw(team, grid, region, u, 0, 0.0, sample, poses)
        assert (samples >= lower).all()
        assert (samples <= upper).all()
        free[tries] = sum(is_free(team, grid, z, 0.0) for z in samples)
    assert free[12] > 0.95 * SAMPLES > free[1]


def test_the_path_for_the_whole_team_at_once_is_free_and_repeats(problem):
    def path():
        workspace = marginal_workspace(problem, 0.015)
        return Sampler(SubsystemHierarchy(problem), workspace, 0.01, 0).direct_path(4_000)

    found = path()
    assert np.array_equal(found[0], problem.start)
    assert np.array_equal(found[-1, :2], problem.goal_pose[:2])
    assert are_free(problem, found).all()
    assert np.array_equal(found, path())


def test_a_path_begins_where_bodies_are_nearer_to_each_other_than_paths_keep(problem):
    team, workspace = team_arrays(problem.tree), marginal_workspace(problem, 0.015)
    grid, random = grid_for_team(workspace, team), np.random.default_rng(5)
    lower, upper = problem.tree.joint_lower, problem.tree.joint_upper
    drawn = (np.array([*problem.start[:3], *random.uniform(lower, upper)]) for _ in range(10_000))
    near = next(z for z in drawn if is_free(team, grid, z, 0.002) and not is_free(team, grid, z, 0.009))
    close = replace(problem, start=near)
    hierarchy = SubsystemHierarchy(close)
    assert 0.001 < hierarchy.gap_at_ends(0.01) < 0.01 == SubsystemHierarchy(problem).gap_at_ends(0.01)
    found = Sampler(hierarchy, workspace, 0.01, 0).direct_path(4_000)
    assert np.array_equal(found[0], near)
    assert are_free(close, found).all()
    given = replace(close, start=problem.start, goal_joints=tuple(near[3:]))
    assert SubsystemHierarchy(given).gap_at_ends(0.01) == hierarchy.gap_at_ends(0.01)


def test_a_part_of_the_team_is_sampled_first_where_it_seems_hard(problem):
    def sampler(asked):
        return Sampler(SubsystemHierarchy(asked), marginal_workspace(asked, 0.015), 0.01, 0)

    found = sampler(problem).direct_path(4_000, (1,))
    assert np.array_equal(found[0], problem.start)
    assert np.array_equal(found[-1, :2], problem.goal_pose[:2])
    assert are_free(problem, found).all()


def test_no_sample_is_spent_on_the_team_where_a_part_of_it_finds_no_path(monkeypatch):
    problem, sampled = corridor_problem(0.7), []
    inner = Sampler._connect

    def connect(self, subsystem, *rest):
        sampled.append(len(subsystem.joints))
        return inner(self, subsystem, *rest)

    monkeypatch.setattr(Sampler, "_connect", connect)
    hierarchy = SubsystemHierarchy(problem)
    for part, most in ((None, 2), ((), 0), ((0,), 1)):
        sampled.clear()
        path = Sampler(hierarchy, marginal_workspace(problem, 0.0), 0.0, 0).direct_path(500, part)
        assert len(path) == 0
        assert max(sampled) == most


def test_a_path_is_sampled_around_the_channel_of_an_exploration():
    problem = corridor_problem(1.2)
    problem = replace(problem, settings=PlannerSettings(strategy="cells", margin=0.0))
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    guide = middle_of(channel, problem.start)
    assert len(guide) == len(channel.boxes)
    assert are_free(problem, guide).all()
    found = SampledSearch(problem).around(guide)
    assert found is not None
    assert np.array_equal(found.path[[0, -1], :2], [problem.start[:2], problem.goal_pose[:2]])
    assert are_free(problem, found.path).all()
