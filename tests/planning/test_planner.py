"""From the question to an answer: plans of the planner, and its proofs."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely import affinity, box, union_all

from benchmarks.adversaries.questions import discs_in_a_corridor
from benchmarks.planner.family import corridor_floor, corridor_problem, shelf_problem
from coop_drake.answers import BeyondLimits, Found, Infeasible, PlanningProblem, SearchReport, Undecided
from coop_drake.answers.plan import Refusal, plan_document
from coop_drake.errors import StallError
from coop_drake.laws import ScheduledGains
from coop_drake.planning import find_channel, planner
from coop_drake.planning.cells.cells import Squeezes
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.channel import CoveredPath, NoChannel
from coop_drake.planning.duration import plan_time
from coop_drake.planning.planner import plan
from coop_drake.planning.proofs import MANY_CORNERS, Proofs, clearance_bound, refuted_at_an_end
from coop_drake.planning.questions import relaxed
from coop_drake.planning.rescaling import Rescaling
from coop_drake.planning.search import find_path
from coop_drake.tree.component_tree import Body, Component, ComponentTree, PlanarPose, TreeJoint
from coop_drake.verification import verify_proof
from tests.planning.test_search import rod_problem
from tests.support.cases import rectangle, transport
from tests.support.channels import bent_channel
from tests.support.free_positions import FreePositions

# The planner's three answers, with the search replaced by channels written by hand.

REPORT = SearchReport(10)


@pytest.fixture
def asked(monkeypatch):
    """Play a list of answers of the search; returns the function that sets them and the questions asked."""
    questions = []

    def play(*answers):
        left = list(answers)

        def find_path(problem, progress=None):
            questions.append(problem)
            return left.pop(0), REPORT

        monkeypatch.setattr(planner, "find_path", find_path)
        return questions

    return play


def blocked(channel):
    """The same channel with an aisle of a tenth of a millimetre as its last cell."""
    last = channel.boxes[-1]
    x0, _, x1, _ = last.polygon.bounds
    wall = box(x0, 6.2, x1, 6.4).difference(box(5.0, 6.1, 5.0001, 6.5))
    return replace(channel, boxes=(*channel.boxes[:-1], replace(last, polygon=last.polygon.difference(wall))))


def ask(problem):
    return planner.plan(problem, ScheduledGains(), gain_set_name="scheduled")


def test_a_question_that_is_changed_afterwards_is_another_question(asked):
    problem, _ = bent_channel(cells=3)
    questions = asked(NoChannel(True, "separated"), NoChannel(True, "separated"))
    ask(problem)
    problem.start[0] += 0.01
    ask(problem)
    assert questions[0] != questions[1]
    assert questions[1].start[0] == pytest.approx(questions[0].start[0] + 0.01)


def test_a_proof_is_infeasible_and_a_spent_budget_undecided(asked):
    problem, _ = bent_channel(cells=3)
    asked(NoChannel(True, "separated"))
    assert ask(problem) == Infeasible("separated", REPORT)
    asked(NoChannel(False, "budget spent"))
    assert ask(problem) == Undecided("budget spent", REPORT)


def test_a_channel_that_stalls_is_searched_again_at_half_the_margin(asked):
    problem, channel = bent_channel(cells=3)
    questions = asked(blocked(channel), channel)
    result = ask(problem)
    assert isinstance(result, Found)
    assert result.report.slices == 20
    assert [question.settings.margin for question in questions] == [0.1, channel.margin / 2]


def test_channels_that_all_stall_are_a_way_with_the_limit_named(asked):
    problem, channel = bent_channel(cells=3)
    questions = asked(*[blocked(channel)] * 3)
    result = ask(problem)
    assert isinstance(result, BeyondLimits)
    assert len(questions) == 3
    assert result.plan.refused_by[0] == Refusal(
        "planner.min_clearance", 2, pytest.approx(5e-5, rel=0.1), 1e-3, "m"
    )
    assert (
        "planner.min_clearance: in cell 2 the object's path or its target has a clearance of 0.0"
        in result.reason
    )


def test_a_stall_at_no_margin_is_not_asked_again(asked):
    problem, channel = bent_channel(cells=3)
    questions = asked(replace(blocked(channel), margin=0.0))
    assert isinstance(ask(problem), BeyondLimits)
    assert len(questions) == 1


# More effort gives plans that are no slower, the same effort the same plan, and no effort the first path.

REPEATED = 2.5
"""An effort that is no whole number: the last path has half of the usual work."""


@pytest.fixture(scope="module")
def problem():
    return rod_problem(0.6)


def effort_of(problem, effort=None, progress=None):
    result = plan(problem, ScheduledGains(), gain_set_name="scheduled", effort=effort, progress=progress)
    assert isinstance(result, Found)
    return result


def test_plans_are_no_slower_with_more_effort_and_repeat(problem):
    results = {effort: effort_of(problem, effort) for effort in (0.0, 1.0, REPEATED)}
    again = effort_of(replace(problem, settings=replace(problem.settings, effort=REPEATED)))
    assert json.dumps(plan_document(again.plan)) == json.dumps(plan_document(results[REPEATED].plan))
    assert plan_time(results[REPEATED].plan) <= plan_time(results[1.0].plan)
    for result in results.values():
        seconds, estimates = np.array(result.report.improvements).T
        assert (np.diff(seconds) > 0.0).all()
        assert (np.diff(estimates) < 0.0).all()
        assert estimates[-1] == pytest.approx(plan_time(result.plan))


@pytest.mark.parametrize("effort", [-0.1, float("nan"), float("inf")])
def test_efforts_without_meaning_are_refused(problem, effort):
    with pytest.raises(ValueError, match=r"allowed are numbers of 0 or more"):
        plan(problem, ScheduledGains(), gain_set_name="scheduled", effort=effort)


def test_only_quicker_plans_are_kept_and_shown():
    asked_for, told = [], []
    problem, _ = bent_channel(cells=3)
    made = effort_of(problem, 1.0).plan

    def lasting(seconds):
        first, *others = (replace(step, estimated_time=0.0) for step in made.transitions)
        return replace(made, transitions=(replace(first, estimated_time=seconds), *others))

    def another(number, share):
        asked_for.append((number, share))
        return CoveredPath(np.zeros((2, 3)), 0.0, bool, another) if number != 2 else None

    plans = iter([lasting(11.0), StallError("too narrow"), lasting(9.0)])

    def make(path):
        latest = next(plans)
        if isinstance(latest, Exception):
            raise latest
        return latest

    found = CoveredPath(np.zeros((2, 3)), 0.0, bool, another)
    asked = replace(problem, settings=replace(problem.settings, effort=4.5))
    result = planner._found(
        asked, found, lasting(10.0), make, SearchReport(0), 0.0, lambda phase, share: told.append(phase)
    )
    assert isinstance(result, Found)
    assert plan_time(result.plan) == 9.0
    assert [seconds for _, seconds in result.report.improvements] == [10.0, 9.0]
    assert asked_for == [(1, 1.0), (2, 1.0), (3, 1.0), (4, 0.5)]
    assert all("10.0 s so far" in phase for phase in told)


def test_a_team_twenty_times_as_large_has_further_paths_too(problem):
    large = Rescaling(problem, 0.05).question()
    found, _ = find_path(large)
    assert isinstance(found, CoveredPath)
    other = found.another(1, 1.0)
    assert other is not None
    assert np.allclose(other.path[0], large.start)
    assert np.allclose(other.path[-1, :2], large.goal_pose[:2])
    assert not np.array_equal(other.path, found.path)


# The same question has the same plan, byte for byte, whatever the hash seed and the number of threads.

_SCRIPT = """
import sys
from pathlib import Path
from coop_drake.laws import ScheduledGains
from coop_drake.answers import save_plan
from coop_drake.planning import planner
from tests.support.passages import FoldingArm
problem = FoldingArm().problem(0.6)
result = planner.plan(problem, ScheduledGains(), gain_set_name="scheduled")
save_plan(result.plan, Path(sys.argv[1]))
print(result.report.slices)
"""


def planned(directory: Path, hash_seed: str, threads: str) -> tuple[bytes, str]:
    """Plan in a process of its own; returns the plan file's bytes and what was told."""
    path = directory / f"plan_{hash_seed}_{threads}.json"
    names = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, **dict.fromkeys(names, threads)}
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(path)],
        env=environment,
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return path.read_bytes(), done.stdout


@pytest.mark.slow
def test_hash_seeds_and_threads_change_no_byte(tmp_path: Path) -> None:
    first, second = planned(tmp_path, "0", "1"), planned(tmp_path, "4242", "2")
    assert first == second


# Relaxations in turns: proofs where there are proofs, none of a feasible case, covers without a gap.


@pytest.mark.slow
def test_the_whole_of_a_team_is_refuted_along_the_few_axes_that_matter() -> None:
    """Six dimensions, no relaxation: theta and the joint of the robot that is in the way come first."""
    exploration = Exploration(transport(0.95, robots=3))
    outcome = exploration.run(1000)
    assert outcome.verdict is Verdict.INFEASIBLE
    assert outcome.slices < 600


def test_one_of_three_robots_is_refuted_in_a_corridor_near_its_critical_width() -> None:
    question, _ = relaxed(corridor_problem(0.9895, 1.5, robots=3), (2,))
    assert Exploration(question).run(1000).verdict is Verdict.INFEASIBLE


def test_bodies_in_each_others_way_are_parted_along_their_own_axis() -> None:
    block = Body("block", None, (rectangle(-0.1, 0.1, -0.3, 0.3),))
    arm = Body("arm", 0, (rectangle(-0.3, 0.3, -0.05, 0.05),))
    slide = TreeJoint("slide", "prismatic", 0, 0, PlanarPose(), 1.0, (1.0, 0.0), -1.0, 1.0)
    tree = ComponentTree(
        (Component("block", None, None, (block,)), Component("arm", 0, slide, (arm,))), frozenset()
    )
    start, goal = np.array([0.0, 0.0, 0.0, -0.6]), np.array([0.5, 0.0, 0.0])
    problem = PlanningProblem(box(-3.0, -3.0, 3.0, 3.0), tree, start, goal, (0.6,))
    assert Exploration(problem).run(200).verdict is Verdict.INFEASIBLE


def test_a_relaxation_refutes_the_whole() -> None:
    proofs = Proofs(transport(0.95, 1.5, 3, 1))
    share = 64
    while proofs.run(share) is Verdict.BUDGET:
        share *= 2
    assert proofs.refutation is not None
    assert "the object with robots [2] alone" in proofs.refutation.reason
    assert proofs.refutation.proof.kind == "slices"
    assert proofs.slices < 600


def test_runs_go_on_where_they_stopped() -> None:
    problem = rod_problem(0.23)
    alone, stepped = Proofs(problem), Proofs(problem)
    assert alone.run(800) is Verdict.FOUND
    for share in (10, 40, 800):
        verdict = stepped.run(share)
    assert verdict is Verdict.FOUND
    assert [box.intervals for box in stepped.boxes()] == [box.intervals for box in alone.boxes()]


def test_a_corridor_narrower_than_the_object_is_refuted_by_the_object_alone() -> None:
    proofs = Proofs(transport(0.45))
    assert proofs.run(40, 0) is Verdict.INFEASIBLE
    assert proofs.refutation is not None
    assert "the object alone" in proofs.refutation.reason


@pytest.mark.parametrize(("corridor", "bound"), [(0.21, 0.01), (0.3, 0.08), (1.0, None)])
def test_the_room_of_a_way_is_bounded(corridor: float, bound: float | None) -> None:
    assert clearance_bound(rod_problem(corridor))[0] == bound


# On large floors the walls near the goal or start prove that no plan exists; the exact checker agrees.


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


# Two round pieces that walls squeeze together: positions so forbidden hold no free configuration.


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
