"""What is feasible stays feasible with robots left out, and its paths lie in all over-cells."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings

from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.cells.graph import Kind
from coop_drake.planning.channel import Channel
from coop_drake.planning.proofs import blocked_goal
from coop_drake.planning.questions import relaxed
from coop_drake.planning.search import find_channel
from tests.support.cases import case
from tests.support.planted import Planted, planted

SLICES = 16


@pytest.mark.slow
@settings(max_examples=6, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
@given(planted(robots=(1, 2)))
def test_a_path_known_to_be_free_lies_in_the_over_cells_of_all_relaxations(plant: Planted) -> None:
    assert blocked_goal(plant.problem)[0] is None
    assert_no_relaxation_loses(plant.problem, plant.path)


@pytest.mark.parametrize("name", ["base"])
def test_a_certified_path_lies_in_the_over_cells_of_all_relaxations(name: str) -> None:
    problem = case(name, PlannerSettings(margin=0.0))
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert channel.path is not None
    assert_no_relaxation_loses(problem, channel.path)


def assert_no_relaxation_loses(problem: PlanningProblem, path: np.ndarray) -> None:
    robots = sorted({joint.robot for joint in problem.tree.joints})
    for chosen in [some for count in range(len(robots) + 1) for some in combinations(robots, count)]:
        question, joints = relaxed(problem, chosen)
        exploration = Exploration(question)
        assert exploration.run(SLICES).verdict is not Verdict.INFEASIBLE
        axes = [2, *[3 + joint for joint in joints]]
        assert all(is_covered(exploration, z[:2], z[axes]) for z in path)


def is_covered(exploration: Exploration, position: np.ndarray, angles: np.ndarray) -> bool:
    """Whether every leaf that holds the angles has an over-cell that holds the position."""
    leaves = exploration.slices.holding([float(angle) for angle in angles])
    return bool(leaves) and all(
        any(
            cell.region.holds(position)
            for cell in exploration.graph.by_slice[leaf]
            if cell.kind is Kind.MIXED
        )
        for leaf in leaves
    )
