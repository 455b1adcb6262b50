"""Boxes that neighbours make superfluous go, the others stay."""

from dataclasses import replace

import numpy as np
from shapely import box

from coop_drake.planning import Channel, FreeBox
from coop_drake.planning.boxes.shortcuts import without_detours


def chain(*intervals, places=None):
    """A channel with one angle, the given intervals, and floors of 2 m x 1 m at the given places."""
    places = places or [0.0] * len(intervals)
    boxes = tuple(
        FreeBox(box(x, 0, x + 2, 1), box(x + 0.1, 0.1, x + 1.9, 0.9), np.array([low]), np.array([high]))
        for (low, high), x in zip(intervals, places, strict=True)
    )
    return Channel(boxes, 0.1, intervals[-1][1])


def kept(channel):
    return [[id(box) for box in channel.boxes].index(id(one)) for one in without_detours(channel).boxes]


def test_a_box_between_two_that_overlap_goes():
    assert kept(chain((0.0, 1.0), (0.4, 1.4), (0.8, 1.8))) == [0, 2]


def test_a_sliver_of_overlap_is_not_enough():
    assert kept(chain((0.0, 1.0), (0.4, 1.4), (0.9, 1.9))) == [0, 1, 2]


def test_boxes_whose_floors_lie_apart_stay_neighbours_of_the_one_between():
    assert kept(chain((0.0, 1.0), (0.0, 1.0), (0.0, 1.0), places=[0.0, 1.5, 3.0])) == [0, 1, 2]


def test_the_way_goes_to_the_farthest_box_within_the_lookahead():
    assert kept(chain(*[(0.0, 1.0)] * 30)) == [0, 24, 29]


def test_first_and_last_box_and_everything_else_stay():
    channel = chain((0.0, 1.0), (0.4, 1.4))
    assert without_detours(channel) == replace(channel)
