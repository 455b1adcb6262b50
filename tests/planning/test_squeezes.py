"""Two round pieces that walls squeeze together: positions so forbidden hold no free configuration."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.adversaries.questions import discs_in_a_corridor
from benchmarks.planner.family import corridor_problem
from coop_drake.planning import find_channel
from coop_drake.planning.cells.cells import Squeezes
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.questions import relaxed
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.verification import verify_proof
from tests.support.free_positions import FreePositions


class Recorded(Squeezes):
    """Keeps every squeezed pair that is found, with its slice."""

    def __init__(self, *given):
        super().__init__(*given)
        self.found = []

    def find(self, intervals, corners, growth):
        pair = super().find(intervals, corners, growth)
        self.found += [(intervals, pair)] if pair is not None else []
        return pair


def two_bases(width):
    """Robots 0 and 2 in a corridor with a bend; the base of robot 2 stays on the side of robot 0."""
    question, _ = relaxed(corridor_problem(width, 1.5, robots=3), (0, 2))
    *others, last = question.tree.components
    last = replace(last, joint=replace(last.joint, lower=0.5))
    start = np.array([*question.start[:4], 1.0])
    return replace(question, tree=ComponentTree((*others, last), question.tree.unchecked_pairs), start=start)


@pytest.mark.slow
def test_walls_that_squeeze_two_bases_together_close_a_corridor_with_few_slices(monkeypatch):
    monkeypatch.setattr("coop_drake.planning.cells.cells.Squeezes", Recorded)
    question = two_bases(0.99)
    exploration = Exploration(question)
    assert exploration.run(1000).verdict is Verdict.INFEASIBLE
    found, random = exploration.maker._squeezes.found, np.random.default_rng(0)
    assert len(found) > 10
    for intervals, pair in found:
        positions = random.dirichlet(np.full(len(pair.polygon), 0.5), 100) @ pair.polygon
        for share in random.random((5, len(intervals))):
            angles = [low + part * (high - low) for part, (low, high) in zip(share, intervals, strict=True)]
            assert not FreePositions(question.tree, question.workspace, angles).free(positions).any()


@pytest.mark.slow
def test_a_proof_with_squeezed_pairs_is_written_down_and_holds():
    problem = discs_in_a_corridor(1.195)
    answer, _ = find_channel(problem)
    assert answer.proved
    assert sum(len(part.squeezes) for part in answer.proof.slices) > 0
    checked = {check.name: check.count for check in verify_proof(answer.proof, problem).checks}
    assert checked["pieces are squeezed in all of a slice"] > 0
