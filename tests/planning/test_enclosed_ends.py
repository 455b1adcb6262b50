"""On large floors the walls near the goal or start prove that no plan exists; the exact checker agrees."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import affinity, box, union_all

from benchmarks.planner.family import corridor_floor, corridor_problem, shelf_problem
from coop_drake.answers import Infeasible, PlanningProblem
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan
from coop_drake.planning.proofs import MANY_CORNERS, refuted_at_an_end
from coop_drake.verification import verify_proof


def behind_a_corridor(width: float) -> PlanningProblem:
    """Shelves, and the goal in a room behind a corridor of some width [m], with a bend."""
    shelves = shelf_problem(MANY_CORNERS + 20)
    *_, x, y = shelves.workspace.bounds
    off = np.array([x - 6.0, y - 1.0, 0.0])
    floor = union_all([shelves.workspace, affinity.translate(corridor_floor(width, 1.2), *off[:2])])
    return replace(shelves, workspace=floor.simplify(0.0), goal_pose=corridor_problem().goal_pose + off)


@pytest.mark.slow
@pytest.mark.no_cover
def test_a_bend_that_is_too_narrow_is_proved_from_the_walls_near_it() -> None:
    question = behind_a_corridor(0.76)
    result = plan(question, ScheduledGains(), gain_set_name="scheduled")
    assert isinstance(result, Infeasible)
    assert result.proof is not None
    cells = [cell.polygon for part in result.proof.slices for cell in part.cells]
    most = max(int(shapely.get_num_coordinates(cell)) for cell in cells)
    assert most < MANY_CORNERS / 2  # shelves far away are not in the certificate
    verify_proof(result.proof, question)  # raises an error where it refuses


def test_a_start_that_cannot_be_left_is_proved_without_the_goal() -> None:
    question = shelf_problem(MANY_CORNERS + 20)
    x, y = question.start[:2]
    fence = box(x - 3.0, y - 3.0, x + 2.6, y + 3.0).difference(box(x - 3.0, y - 3.0, x + 2.4, y + 2.8))
    gap = box(x - 0.2, y, x + 0.2, y + 4.0)
    fenced = replace(question, workspace=question.workspace.difference(fence.difference(gap)))
    refutation, _ = refuted_at_an_end(fenced)
    assert refutation is not None
    verify_proof(refutation.proof, fenced)


def test_nothing_is_proved_where_the_team_can_go_or_the_floor_is_small() -> None:
    refutation, slices = refuted_at_an_end(shelf_problem(MANY_CORNERS + 20))
    assert refutation is None
    assert slices > 0
    assert refuted_at_an_end(corridor_problem(0.7)) == (None, 0)
