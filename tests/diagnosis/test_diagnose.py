"""Why there is no plan: passages, contacts, and the command that says so."""

import json
from dataclasses import replace

import numpy as np
import pytest
from shapely import box, union_all

from coop_drake.answers import PlannerSettings, PlanningProblem
from coop_drake.cli.results import ResultFolder
from coop_drake.diagnosis import Answer, diagnose, diagnosing, diagnosis_figure, facts_of, sentences_of
from coop_drake.diagnosis import diagnosing as relaxations
from coop_drake.diagnosis.contacts import colliding_stretches, contacts, narrowest_gap, overlaps
from coop_drake.diagnosis.diagnosing import SLICES, changes, find_passages, try_changes
from coop_drake.diagnosis.variants import BudgetedPlanner, WidenedFloor, on_open_floor
from coop_drake.drawing import save_figure
from coop_drake.planning import Channel, find_channel
from coop_drake.tree.component_tree import Body, Component, ComponentTree, PlanarPose, TreeJoint
from tests.support.cases import case, disc, rectangle, team_tree
from tests.support.cli import invoke
from tests.support.scenarios import write_scenario

ROD = 0.2
CORRIDOR = 0.15


def two_rooms(width: float, tree: ComponentTree, joints: tuple[float, ...] = ()) -> PlanningProblem:
    """Two rooms joined by a corridor along x, from x = -1 to 1, in whose middle line y is 0."""
    half = 0.5 * width
    floor = union_all([box(-4, -1.2, -1, 1.2), box(-1.1, -half, 1.1, half), box(1, -1.2, 4, 1.2)])
    free = (None,) * len(joints)
    start, goal = np.array([-2.5, 0.0, 0.4, *joints]), np.array([2.5, 0.0, 0.4])
    return PlanningProblem(floor, tree, start, goal, free, settings=PlannerSettings(max_slices=800))


def rod_tree() -> ComponentTree:
    rod = Body("rod", None, (rectangle(-0.5, 0.5, -0.5 * ROD, 0.5 * ROD),))
    return ComponentTree((Component("rod", None, None, (rod,)),), frozenset())


def bent_tree(lower: float = 0.9, upper: float = 1.3) -> ComponentTree:
    """Two bars of 0.6 x 0.1 m with a hinge between them that cannot be straightened."""
    bar = rectangle(0.0, 0.6, -0.05, 0.05)
    joint = TreeJoint("arm::hinge", "revolute", 0, 0, PlanarPose(0.6), 1.0, (1.0, 0.0), lower, upper)
    components = (
        Component("bar", None, None, (Body("bar", None, (bar,)),)),
        Component("arm", 0, joint, (Body("arm", 0, (bar,)),)),
    )
    return ComponentTree(components, frozenset({("bar", "arm")}))


@pytest.fixture(scope="module")
def rod():
    problem = two_rooms(CORRIDOR, rod_tree())
    return problem, diagnose(problem)


def test_the_missing_width_of_a_corridor_is_bracketed_closely(rod):
    _, diagnosis = rod
    assert diagnosis.answer is Answer.INFEASIBLE
    (passage,) = diagnosis.passages.passages
    assert 2.0 * passage.refuted <= ROD - CORRIDOR <= 2.0 * passage.enough
    assert 2.0 * (passage.enough - passage.refuted) < 0.03
    assert diagnosis.passages.are_enough


def test_the_pinching_walls_are_those_of_the_corridor(rod):
    _, diagnosis = rod
    gap = diagnosis.passages.passages[0].stretch.gap
    assert gap.width == pytest.approx(CORRIDOR)
    assert sorted([gap.first[1], gap.second[1]]) == pytest.approx([-CORRIDOR / 2, CORRIDOR / 2])
    assert -1.0 <= gap.first[0] <= 1.0


def test_the_body_at_fault_is_named_with_its_angles(rod):
    _, diagnosis = rod
    (body,) = diagnosis.passages.passages[0].stretch.bodies
    assert (body.name, body.robot, body.axes) == ("rod", None, ("theta",))
    # It goes through along the corridor, whichever end first.
    lower, upper = body.intervals[0]
    assert abs(np.sin(lower)) < 0.3
    assert abs(np.sin(upper)) < 0.3


def test_a_smaller_object_is_bracketed_and_holds_when_planned_again(rod):
    problem, diagnosis = rod
    (relaxation,) = diagnosis.relaxations
    bracket = relaxation.bracket
    assert relaxation.change.name == "smaller object"
    assert bracket.refuted <= 1.0 - CORRIDOR / ROD <= bracket.found
    answer, _ = find_channel(replace(problem, tree=relaxation.change.tree(bracket.found + 0.02)))
    assert isinstance(answer, Channel)
    answer, _ = find_channel(replace(problem, tree=relaxation.change.tree(0.8 * bracket.refuted)))
    assert not isinstance(answer, Channel)


@pytest.mark.slow
def test_a_joint_range_at_fault_is_found_out(monkeypatch):
    monkeypatch.setattr(relaxations, "changes", lambda tree: changes(tree)[-1:])  # The others are as slow.
    problem = two_rooms(0.3, bent_tree(), (1.1,))
    assert not isinstance(find_channel(problem)[0], Channel)
    kinds = try_changes(problem, BudgetedPlanner(60, 10_000), refuted=True)
    wider = {relaxation.change.name: relaxation for relaxation in kinds}["wider joint range"]
    assert 0.0 <= wider.bracket.refuted < wider.bracket.found < 1.0
    answer, _ = find_channel(replace(problem, tree=wider.change.tree(wider.bracket.found + 0.05)))
    assert isinstance(answer, Channel)


def test_the_joint_interval_of_a_body_at_fault_is_that_of_its_own_joint():
    problem = two_rooms(0.3, bent_tree(), (1.1,))
    path = np.array(
        [[-2.5, 0.0, 0.4, 1.1], [0.0, 0.0, -0.5, 1.0], [0.2, 0.0, -0.5, 1.2], [2.5, 0.0, 0.4, 1.1]]
    )
    (stretch,) = colliding_stretches(problem, path)
    bodies = {body.name: body for body in stretch.bodies}
    assert bodies["bar"].axes == ("theta",)
    assert bodies["arm"].axes == ("theta", "arm::hinge")
    assert bodies["arm"].intervals == ((-0.5, -0.5), (1.0, 1.2))


def test_a_feasible_question_is_said_to_be_so():
    diagnosis = diagnose(two_rooms(0.6, rod_tree()))
    assert diagnosis.answer is Answer.FOUND
    assert sentences_of(diagnosis) == ["Feasible: a channel was found."]
    assert diagnosis_figure(two_rooms(0.6, rod_tree()), diagnosis) is None


@pytest.mark.slow
def test_two_passages_in_a_row_are_both_named_each_with_what_it_misses():
    floor = [box(-4, -1.2, -1, 1.2), box(-1.1, -0.075, 1.1, 0.075), box(1, -1.2, 4, 1.2)]
    floor += [box(3.9, 0.91, 6.1, 1.09), box(6, -1.2, 9, 1.2)]
    problem = two_rooms(ROD, rod_tree())
    problem = replace(problem, workspace=union_all(floor), goal_pose=np.array([7.5, 0.0, 0.4]))
    floor = WidenedFloor(problem.workspace, problem.start[:2], 0.25)
    findings = find_passages(problem, floor, BudgetedPlanner(SLICES, 10_000), refuted=True)
    assert findings.are_enough
    assert [passage.stretch.gap.width for passage in findings.passages] == pytest.approx([0.15, 0.18])
    for passage, missing in zip(findings.passages, (0.05, 0.02), strict=True):
        assert passage.refuted == 0.0
        assert missing <= 2.0 * passage.enough < missing + 0.02


def test_a_team_in_its_own_way_is_told_which_bodies():
    # A bar of the arm would have to pass through the object, which lies across all of its range.
    joint = TreeJoint("arm::slide", "prismatic", 0, 0, PlanarPose(), 1.0, (1.0, 0.0), -0.8, 0.8)
    components = (
        Component("block", None, None, (Body("block", None, (rectangle(-0.1, 0.1, -0.3, 0.3),)),)),
        Component("arm", 0, joint, (Body("arm", 0, (rectangle(-0.1, 0.1, -0.05, 0.05),)),)),
    )
    start, goal = np.array([0.0, 0.0, 0.0, -0.5]), np.array([0.5, 0.0, 0.0])
    problem = PlanningProblem(box(-2, -2, 2, 2), ComponentTree(components, frozenset()), start, goal, (0.5,))
    bare = on_open_floor(problem, BudgetedPlanner(20, 10_000))
    assert bare.answer is not Answer.FOUND
    assert bare.pairs == (("block", "arm"),)


@pytest.mark.slow
def test_a_blocked_goal_names_the_body_the_wall_and_the_depth():
    problem = replace(case("base"), goal_pose=np.array([6.2, 4.5, 0.0]))
    diagnosis = diagnose(problem)
    assert diagnosis.answer is Answer.INFEASIBLE
    goal = diagnosis.goal
    # The hand reaches to x = 7, where the wall is, and the base of that arm stands behind it.
    assert {contact.robot for contact in goal.contacts} == {0}
    assert all(contact.wall[0] == pytest.approx(7.0) for contact in goal.contacts)
    assert goal.widening.refuted <= goal.contacts[0].depth <= goal.widening.found + 1e-3
    assert any("At the goal robot_0" in sentence for sentence in sentences_of(diagnosis))


def test_an_undecided_question_says_what_remained_mixed(monkeypatch):
    monkeypatch.setattr(diagnosing, "find_passages", lambda *_, **__: None)  # They have tests of their own.
    monkeypatch.setattr(diagnosing, "try_changes", lambda *_, **__: [])
    problem = two_rooms(0.2001, rod_tree())
    tiny = replace(problem, settings=PlannerSettings(max_slices=8, strategy="cells"))
    diagnosis = diagnose(tiny)
    assert diagnosis.answer is Answer.UNDECIDED
    assert diagnosis.mixed
    said = " ".join(sentences_of(diagnosis))
    assert "neither free nor blocked" in said
    assert "planner.max_slices" in said
    assert facts_of(diagnosis)["mixed"][0]["share_of_axis"] == diagnosis.mixed[0].width_fraction


def test_the_same_diagnosis_has_the_same_picture(rod, tmp_path):
    for number in range(2):
        save_figure(diagnosis_figure(*rod), tmp_path / f"{number}.svg")
    assert (tmp_path / "0.svg").read_bytes() == (tmp_path / "1.svg").read_bytes()


def test_an_interrupt_comes_through():
    def stop(stage, share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        diagnose(two_rooms(CORRIDOR, rod_tree()), stop)


# Which bodies leave the floor, where, by how much; which walls face each other.


ROOM = box(0.0, 0.0, 4.0, 1.0)


def lone(shape) -> ComponentTree:
    return ComponentTree((Component("load", None, None, (Body("load", None, (shape,)),)),), frozenset())


def test_a_body_too_tall_for_a_room_sticks_out_on_both_sides():
    found = contacts(ROOM, lone(rectangle(-0.5, 0.5, -0.6, 0.6)), np.array([2.0, 0.45, 0.0]))
    assert [contact.depth for contact in found] == pytest.approx([0.15, 0.05])
    assert found[0].wall[1] == pytest.approx(0.0)
    assert found[0].point[1] == pytest.approx(-0.15)
    assert found[1].wall[1] == pytest.approx(1.0)


def test_a_wall_corner_that_pierces_a_body_counts():
    floor = box(0.0, 0.0, 4.0, 4.0).difference(box(2.0, 0.0, 4.0, 2.0))
    # A square turned by 45 degrees whose side passes 0.1 m behind the corner (2, 2).
    centre = np.array([2.0, 2.0]) + (0.5 - 0.1) * np.array([-1.0, 1.0]) / np.sqrt(2.0)
    (found,) = contacts(floor, lone(rectangle(-0.5, 0.5, -0.5, 0.5)), np.array([*centre, np.pi / 4]))
    assert found.depth == pytest.approx(0.1)
    assert found.wall == pytest.approx([2.0, 2.0])


def test_the_depth_of_an_overlap_is_the_way_out():
    joint = TreeJoint("arm::slide", "prismatic", 0, 0, PlanarPose(), 1.0, (1.0, 0.0), 0.0, 3.0)
    tree = ComponentTree(
        (
            Component("load", None, None, (Body("load", None, (rectangle(-0.5, 0.5, -0.5, 0.5),)),)),
            Component("arm", 0, joint, (Body("arm", 0, (disc(0.2),)),)),
        ),
        frozenset(),
    )
    (found,) = overlaps(tree, np.array([0.0, 0.0, 0.0, 0.65]))
    assert found.bodies == ("load", "arm")
    assert found.depth == pytest.approx(0.05)
    assert overlaps(tree, np.array([0.0, 0.0, 0.0, 0.71])) == []
    assert overlaps(team_tree(), np.zeros(5)) == []


def test_a_gap_joins_walls_that_face_each_other():
    floor = box(0, 0, 2, 2).union(box(1.5, 0.8, 3.5, 1.2)).union(box(3, 0, 5, 2))
    gap = narrowest_gap(floor, [np.array([2.4, 0.8])])
    assert gap is not None
    assert gap.width == pytest.approx(0.4)
    assert gap.second == pytest.approx([2.4, 1.2])


def test_a_corner_of_a_bend_faces_the_outer_walls():
    bend = box(0, 0, 0.8, 3).union(box(0, 2, 3, 3))
    gap = narrowest_gap(bend, [np.array([0.8, 2.0])])
    assert gap is not None
    assert gap.width == pytest.approx(0.8)
    assert gap.second == pytest.approx([0.0, 2.0])


# The command why: answers, exit codes, pictures, and no traceback for a user's mistake.


def told_by(path, folder):
    """Commands that report the same plan of a scenario."""
    watch = ("watch", path, "--strategy", "portfolio", "--frames", 2, "--output", folder / "think")
    return ("plan", path, "--out", folder / "plan"), ("why", path, "--out", folder / "why"), watch


@pytest.fixture
def blocked(tmp_path):
    """A goal at which a hand just fits before the wall, but not the base behind it."""
    goal = {"object": {"x": 5.2, "y": 2.0, "theta": 0.0}}
    return write_scenario(tmp_path / "blocked.scenario.yaml", goal=goal)


@pytest.mark.slow
def test_a_blocked_goal_gets_its_sentences_pictures_and_exit_code_3_and_again(blocked, tmp_path):
    out, answers = tmp_path / "out", []
    for _ in range(2):
        result = invoke("why", blocked, "--out", out, "--json")
        assert result.exit_code == 3, result.stderr
        facts = json.loads(result.stdout)
        kept = {name: fact for name, fact in facts.items() if not name.endswith(("seconds", "_mb"))}
        answers.append(kept)
    assert answers[0] == answers[1]
    assert facts["answer"] == "infeasible"
    assert {contact["body"].split("::")[0] for contact in facts["goal"]["contacts"]} == {"robot_0"}
    assert facts["goal"]["walls_moved_back_m"]["found_enough"] > 0.1
    assert facts["diagnosis_cpu_seconds"] > 0.0
    assert facts["sentences"][0] in " ".join(result.stderr.split())
    assert sorted(path.name for path in out.iterdir()) == [".coop_drake_results.json", "why.png", "why.svg"]
    assert (out / "why.svg").read_text().lstrip().startswith("<?xml")


@pytest.mark.slow
def test_a_feasible_scenario_is_said_to_be_so_and_an_older_picture_goes(tmp_path):
    path, out = write_scenario(tmp_path / "room.scenario.yaml"), tmp_path / "out"
    ResultFolder(out).begin("diagnosis")
    (out / "why.png").write_bytes(b"of an older diagnosis")
    result = invoke("why", path, "--out", out)
    assert result.exit_code == 0, result.output
    assert "Nothing blocks: there is a plan" in result.output
    rows = [json.loads(invoke(*command, "--json").stdout) for command in told_by(path, tmp_path)]
    for name in ("answer", "cells", "narrowest_neck_m", "estimated_seconds"):
        assert len({facts[name] for facts in rows}) == 1, name
    assert [path.name for path in out.iterdir()] == [".coop_drake_results.json"]


def test_plan_points_to_why(blocked, tmp_path):
    result = invoke("plan", blocked, "--out", tmp_path / "out")
    assert result.exit_code == 3
    assert f"coop-drake why {blocked}" in result.output.replace("\n", "")
