"""Clearances at one configuration, by hand."""

import numpy as np
import pytest
from shapely import Polygon, box

from coop_drake.plant.problem import body_clearance, wall_clearance
from coop_drake.tree.component_tree import Body, ConvexShape
from coop_drake.tree.pose import PlanarPose

ROOM = Polygon(box(0.0, 0.0, 4.0, 3.0).exterior, [box(2.0, 1.0, 2.5, 1.5).exterior.coords])
DISC = Body("disc", 0, (ConvexShape(np.array([[0.1, 0.0]]), 0.2),))
BAR = Body("bar", 0, (ConvexShape(np.array([[-0.5, 0.0], [0.5, 0.0]]), 0.1),))
PAIR = Body("pair", 0, (ConvexShape(np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])), *DISC.shapes))


@pytest.mark.parametrize(
    ("body", "pose", "clearance"),
    [
        (DISC, PlanarPose(0.9, 1.0, 0.0), 0.8),
        (DISC, PlanarPose(1.0, 0.6, -np.pi / 2), 0.3),
        (DISC, PlanarPose(1.5, 1.2, 0.0), 0.2),
        (DISC, PlanarPose(0.0, 1.2, 0.0), -0.1),
        (DISC, PlanarPose(-1.1, 1.2, 0.0), -1.2),
        (DISC, PlanarPose(2.15, 1.25, 0.0), -0.45),
        (BAR, PlanarPose(1.0, 0.8, np.pi / 2), 0.2),
        (BAR, PlanarPose(2.25, 0.7, 0.0), 0.2),
        (BAR, PlanarPose(0.3, 1.0, 0.0), -0.3),
        (PAIR, PlanarPose(0.05, 1.9, 0.0), -0.05),
        (PAIR, PlanarPose(0.4, 1.7, 0.0), 0.3),
        (Body("frame", 0, ()), PlanarPose(-9.0, 0.0, 0.0), np.inf),
    ],
)
def test_clearance_to_the_walls(body, pose, clearance):
    assert wall_clearance(body, pose, ROOM) == pytest.approx(clearance)


@pytest.mark.parametrize(
    ("first", "second", "pose", "clearance"),
    [
        (DISC, DISC, PlanarPose(1.0, 0.0, 0.0), 0.6),
        (DISC, DISC, PlanarPose(0.2, 0.0, np.pi), -0.4),
        (DISC, BAR, PlanarPose(0.1, 0.6, 0.0), 0.3),
        (PAIR, BAR, PlanarPose(2.0, 0.5, 0.0), 0.4),
        (PAIR, PAIR, PlanarPose(0.5, 0.5, 0.3), -0.2),
    ],
)
def test_clearance_between_bodies(first, second, pose, clearance):
    assert body_clearance(first, PlanarPose(), second, pose) == pytest.approx(clearance)
