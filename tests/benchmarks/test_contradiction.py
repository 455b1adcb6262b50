"""A path that stands the dense check refutes a "no"; a wrong one does not, nor any beside another answer."""

import numpy as np
import pytest

from benchmarks.isolated import Isolated
from benchmarks.planner import contradiction
from benchmarks.planner.contradiction import Patience, contradiction_rows
from benchmarks.planner.family import first_question
from benchmarks.planner.ours import Planned, plan_repeatedly
from benchmarks.questions.peers import PeerRun

EASY = first_question()
HONEST = np.array([EASY.start, [*EASY.goal_pose, 0.3, -0.2]])
WRONG = np.array([EASY.start, [9.0, 9.0, 0.0, 0.0, 0.0]])


def figures(rows):
    return {row.figure: (row.value, row.unit) for row in rows}


@pytest.mark.slow
@pytest.mark.parametrize(("answer", "contradictions"), [("infeasible", 1), ("undecided", 0)])
def test_only_paths_that_hold_contradict_and_only_a_no(monkeypatch, answer, contradictions):
    ours = Planned(answer, 1.0, 1.0, 1, 1, 0.0, 0.0)
    peers = (PeerRun(1, 2.0, HONEST, 10), PeerRun(2, 3.0, WRONG, 20))

    def faked(work, *arguments, limit):
        return Isolated((ours,) if work is plan_repeatedly else peers, 1.0, None)

    monkeypatch.setattr(contradiction, "in_own_process", faked)
    monkeypatch.setattr(contradiction, "has_ompl", lambda: False)
    rows = figures(contradiction_rows("planner/no_way/easy", EASY, Patience()))
    assert rows["answer"] == (float(answer == "infeasible"), answer)
    assert rows["contradictions"] == (contradictions, "paths in 2 runs, 5 CPU s")
    assert rows["paths_found"] == (1, "paths")
    assert rows["checks"] == (30, "checks")
