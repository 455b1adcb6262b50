"""Turning, shifting, mirroring or measuring the scene in another unit changes no answer."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RotationMatrix

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.channel import Channel
from coop_drake.planning.search import find_channel
from coop_drake.plant.chain import planar_pose
from coop_drake.tree.component_tree import TreeJoint, nearest_turn
from coop_drake.verification.answer import same_angle
from tests.support.cases import team_tree
from tests.support.moved import Similarity
from tests.support.passages import DiscDoor, FoldingArm, LadderCorner, RodCorridor

PASSAGES = (DiscDoor(), RodCorridor(), LadderCorner(), FoldingArm())
SHIFTS = st.sampled_from((0.0, 1e4, -12345.678, 0.1))
SIMILARITIES = st.builds(
    Similarity,
    angle=st.one_of(st.sampled_from((0.0, 0.5 * np.pi, np.pi)), st.floats(-7.0, 7.0)),
    shift=st.tuples(SHIFTS, SHIFTS),
    mirror=st.booleans(),
    scale=st.sampled_from((1.0, 0.1, 10.0, 1000.0)),
)


@pytest.mark.slow
@settings(max_examples=9)
@given(st.sampled_from(PASSAGES), st.sampled_from((0.02, -0.02)), SIMILARITIES)
def test_a_passage_is_passed_or_blocked_wherever_it_stands(
    passage, offset: float, similarity: Similarity
) -> None:
    answer, _ = find_channel(similarity.question(passage.problem(passage.critical + offset)))
    if offset > 0.0:
        assert isinstance(answer, Channel)
    else:
        assert not isinstance(answer, Channel)
        assert answer.proved


@settings(max_examples=4)
@given(st.sampled_from(PASSAGES), st.sampled_from((0.02, -0.02)), st.integers(-3, 3), st.integers(-3, 3))
def test_whole_turns_of_start_and_goal_change_no_answer(
    passage, offset: float, first: int, last: int
) -> None:
    problem = passage.problem(passage.critical + offset)
    turned = replace(
        problem,
        start=problem.start + 2.0 * np.pi * first * (np.arange(len(problem.start)) == 2),
        goal_pose=problem.goal_pose + np.array([0.0, 0.0, 2.0 * np.pi * last]),
    )
    answer, _ = find_channel(turned)
    assert isinstance(answer, Channel) == (offset > 0.0)
    if isinstance(answer, Channel):
        assert same_angle(answer.goal_angle, problem.goal_pose[2])
        assert answer.boxes[0].lower[0] <= turned.start[2] <= answer.boxes[0].upper[0]
    else:
        assert answer.proved


@given(st.floats(-100.0, 100.0), st.integers(-9, 9))
def test_every_part_takes_angles_apart_by_whole_turns_for_one(angle: float, turns: int) -> None:
    turned = angle + 2.0 * np.pi * turns
    assert same_angle(angle, turned)
    assert same_angle(nearest_turn(turned), angle)
    assert nearest_turn(turned - angle) == pytest.approx(0.0, abs=1e-12)
    assert same_angle(
        planar_pose(RigidTransform(RotationMatrix.MakeZRotation(turned), np.zeros(3))).angle, angle
    )


@settings(max_examples=20)
@given(SIMILARITIES, st.booleans())
def test_a_moved_team_stands_where_its_image_stands(similarity: Similarity, sliding: bool) -> None:
    """The images of all corners are the corners of the image: that the question is moved as it should be."""
    problem = FoldingArm().problem(0.4)
    tree = team_tree(2, 2)
    if sliding:
        components = tuple(
            component if component.joint is None else replace(component, joint=_sliding(component.joint))
            for component in tree.components
        )
        tree = replace(tree, components=components)
    z = np.array([1.0, 2.0, 0.5, 0.1, -0.2, 0.3, 0.4])
    problem = replace(problem, tree=tree, start=z, goal_pose=z[:3], goal_joints=(None,) * 4)
    image = similarity.question(problem)
    corner = _corners(problem) * np.array([1.0, similarity.sign]) * similarity.scale
    c, s = np.cos(similarity.angle), np.sin(similarity.angle)
    expected = corner @ np.array([[c, s], [-s, c]]) + similarity.shift
    found = _corners(image)
    gaps = np.abs(expected[:, None, :] - found[None, :, :]).max(axis=2)
    assert max(gaps.min(axis=0).max(), gaps.min(axis=1).max()) < 1e-9 * (1e4 + similarity.scale)


def _sliding(joint: TreeJoint) -> TreeJoint:
    return replace(joint, kind="prismatic", axis=(0.6, 0.8))


def _corners(problem: PlanningProblem) -> np.ndarray:
    poses = problem.tree.poses(problem.start)
    return np.concatenate(
        [
            X_WC.apply(shape.vertices)
            for X_WC, component in zip(poses, problem.tree.components, strict=True)
            for body in component.bodies
            for shape in body.shapes
        ]
    )
