"""Relaxations in turns: proofs where there are proofs, none of a feasible case, covers without a gap."""

from itertools import combinations

import numpy as np
import pytest
from shapely import Point, Polygon, box

from benchmarks.planner.family import corridor_problem
from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.blocked_goal import blocked_goal
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.proofs import Proofs, clearance_bound
from coop_drake.planning.questions import relaxed
from coop_drake.planning.sampling.sampler import inscribed_disc
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import PlanarPose
from tests.planning.test_search import rod_problem
from tests.support.cases import case, rectangle, transport


def covered(problem: PlanningProblem, lower: np.ndarray, upper: np.ndarray) -> bool:
    """Whether boxes fill theta's turn and the joints' limits: their volumes add up and none overlap."""
    limits = zip(problem.tree.joint_lower, problem.tree.joint_upper, strict=True)
    whole = 2.0 * np.pi * np.prod([b - a for a, b in limits])
    middle = 0.5 * (lower + upper)
    apart = True
    for i, j in combinations(range(len(lower)), 2):
        gap = np.abs(middle[i] - middle[j])
        gap[0] = abs((gap[0] + np.pi) % (2.0 * np.pi) - np.pi)
        apart &= bool((gap >= 0.5 * (upper[i] - lower[i] + upper[j] - lower[j]) - 1e-9).any())
    return apart and bool(np.isclose(np.prod(upper - lower, axis=1).sum(), whole))


@pytest.mark.parametrize("robots", [(), (1,)])
def test_an_ended_proof_covers_every_angle(robots: tuple[int, ...]) -> None:
    question, _ = relaxed(case("closed"), robots)
    exploration = Exploration(question)
    assert exploration.run(1500).verdict is Verdict.INFEASIBLE
    leaves = [exploration.slices.all[index].intervals for index in exploration.over_leaves()]
    lower, upper = np.moveaxis(np.array(leaves), 2, 0)
    assert covered(question, lower, upper)


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
    assert proofs.refutation.robots == (2,)
    assert proofs.refutation.proof.kind == "slices"
    assert proofs.slices < 600


@pytest.mark.slow
@pytest.mark.parametrize("name", ["base", "tight", "three", "elbow"])
def test_nothing_is_refuted_that_is_feasible(name: str) -> None:
    proofs = Proofs(case(name))
    assert proofs.run(48) in (Verdict.BUDGET, Verdict.FOUND)
    assert proofs.run(96, robots=1) in (Verdict.BUDGET, Verdict.FOUND)
    assert proofs.refutation is None


def test_before_a_run_nothing_is_known() -> None:
    proofs = Proofs(rod_problem(0.23))
    assert proofs.undecided() == ()
    assert proofs.run(10) is Verdict.BUDGET
    assert proofs.undecided()


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
    assert proofs.refutation.robots == ()


@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize("ring", [[(0, 0), (2, 0), (2, 1), (0, 1)], [(0, 0), (3, 0), (0, 1)], [(1, 1)]])
def test_inscribed_discs_lie_inside(ring: list[tuple[float, float]], radius: float) -> None:
    shape = ConvexShape(np.array(ring, dtype=float), radius)
    disc = inscribed_disc(shape, 1e-4)
    if len(ring) < 3:
        assert disc.radius == radius
    else:
        hull = Polygon(ring).buffer(radius, quad_segs=64)
        assert hull.buffer(1e-3).contains(Point(disc.vertices[0]).buffer(disc.radius))
        assert disc.radius > 0.3 + radius


def test_a_goal_in_collision_is_stated() -> None:
    problem = case("base")
    proof, slices = blocked_goal(
        PlanningProblem(
            problem.workspace, problem.tree, problem.start, np.array([6.2, 4.5, 0.0]), (None, None)
        )
    )
    assert proof is not None
    assert proof.kind == "blocked goal"
    assert slices <= 128
    lower, upper = (np.array([getattr(part, end) for part in proof.slices]) for end in ("lower", "upper"))
    assert covered(problem, lower, upper)
    assert blocked_goal(problem)[0] is None


@pytest.mark.parametrize(("corridor", "bound"), [(0.21, 0.01), (0.3, 0.08), (1.0, None)])
def test_the_room_of_a_way_is_bounded(corridor: float, bound: float | None) -> None:
    assert clearance_bound(rod_problem(corridor))[0] == bound
