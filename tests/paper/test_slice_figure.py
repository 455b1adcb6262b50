"""The figure of slices: a narrow slice proves more of the floor free, and leaves less undecided."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from paper import slice_figure
from tests.support.cases import case
from tests.support.sliding import with_sliding_joint


@pytest.fixture(scope="module")
def figure():
    wide, narrow = (((1.57 - h, 1.57 + h), (-h, h), (-h, h)) for h in (0.4, 0.1))
    return slice_figure(case("base"), [wide, narrow])


def areas(axes):
    texts = [text.get_text() for text in axes.get_legend().get_texts()[:2]]
    return [float(re.search(r": ([\d.]+) m²", text)[1]) for text in texts]


def test_every_slice_has_its_footprints_and_its_cells(figure):
    assert len(figure.axes) == 4
    assert figure.axes[0].get_title(loc="left").startswith("θ 67° to 113°,  robot_0 joint_1 -23° to 23°")


def test_what_is_proved_free_and_what_may_be_free_come_closer_in_a_narrow_slice(figure):
    (free, maybe), (free_in_narrow, maybe_in_narrow) = (areas(figure.axes[row]) for row in (1, 3))
    assert free < free_in_narrow < maybe_in_narrow < maybe


def test_footprints_are_drawn_to_one_scale(figure):
    assert figure.axes[0].get_xlim() == figure.axes[2].get_xlim()


def test_a_sliding_joint_is_labelled_in_metres():
    problem = case("base")
    problem = replace(problem, tree=with_sliding_joint(problem.tree))
    left = slice_figure(problem, [((1.5, 1.6), (-0.1, 0.1), (-0.05, 0.05))]).axes[0]
    assert left.get_title(loc="left").endswith(",  robot_1 joint_1 -0.05 m to 0.05 m")
