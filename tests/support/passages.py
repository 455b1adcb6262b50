"""Passages whose critical width is known exactly: feasible above it, infeasible at and below it."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from shapely import Polygon, box, union_all

from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint
from tests.support.cases import disc, rectangle

SETTINGS = PlannerSettings()


def _alone(shape: ConvexShape) -> ComponentTree:
    body = Body("object", None, (shape,))
    return ComponentTree((Component("object", None, None, (body,)),), frozenset())


def _floor(*rooms: Polygon) -> Polygon:
    floor = union_all(rooms)
    assert isinstance(floor, Polygon)
    return floor


class DiscDoor:
    """A disc of radius 0.3 through a door in a thin wall: its diameter."""

    critical = 0.6

    def problem(self, width: float, settings: PlannerSettings = SETTINGS) -> PlanningProblem:
        """The question at a width [m]."""
        floor = _floor(box(-3, -1, -0.05, 1), box(-0.1, -width / 2, 0.1, width / 2), box(0.05, -1, 3, 1))
        start, goal = np.array([-1.5, 0.1, 0.3]), np.array([1.5, -0.2, 2.0])
        return PlanningProblem(floor, _alone(disc(0.3)), start, goal, (), settings=settings)


class RodCorridor:
    """A rectangle of 1.0 x 0.2 through a corridor longer than itself: its breadth."""

    critical = 0.2

    def problem(self, width: float, settings: PlannerSettings = SETTINGS) -> PlanningProblem:
        """The question at a width [m]; it starts and ends across the corridor."""
        half = width / 2
        floor = _floor(box(-4, -1, -1, 1), box(-1.1, -half, 1.1, half), box(1, -1, 4, 1))
        start, goal = np.array([-2.5, 0.0, 1.5]), np.array([2.5, 0.0, 1.5])
        tree = _alone(rectangle(-0.5, 0.5, -0.1, 0.1))
        return PlanningProblem(floor, tree, start, goal, (), settings=settings)


class LadderCorner:
    """A rectangle of length 1.0 and breadth 0.2 around the right-angled corner of two corridors of one width.

    Touching both outer walls at an angle t, its inner side passes the inner corner at the distance
    ``w (sin t + cos t) - L sin t cos t - b``. That is concave in ``sin t + cos t``, so it is least at 45
    degrees: ``sqrt(2) w = b + L / 2``. Corridors are narrower than L, so it has to turn.
    """

    critical = (0.2 + 0.5) / sqrt(2.0)

    def problem(self, width: float, settings: PlannerSettings = SETTINGS) -> PlanningProblem:
        """The question at a width [m]."""
        floor = _floor(box(0, 0, 3, width), box(0, 0, width, 3))
        start, goal = np.array([2.0, width / 2, 0.0]), np.array([width / 2, 2.0, -pi / 2])
        tree = _alone(rectangle(-0.5, 0.5, -0.1, 0.1))
        return PlanningProblem(floor, tree, start, goal, (), settings=settings)


class FoldingArm:
    """An object of 0.8 x 0.3 with a lid of 0.8 x 0.04 hinged at a corner: it has to shut to pass a corridor.

    Shut (q = 0), both make a rectangle of 0.8 x 0.34. Open by q > 0 they are at least as wide: turned by phi
    the object alone takes ``0.3 cos(phi) + 0.8 sin|phi|``, and the lid's back rises above its corner by
    ``0.04 cos(phi - q)`` where phi > 0, its far end by more where phi < 0.
    """

    critical = 0.34

    def problem(self, width: float, settings: PlannerSettings = SETTINGS) -> PlanningProblem:
        """The question at a width [m]; the lid stands open at the start and at the goal."""
        half = width / 2
        floor = _floor(box(-3.2, -1.2, -0.8, 1.2), box(-0.9, -half, 0.9, half), box(0.8, -1.2, 3.2, 1.2))
        hinge = TreeJoint(
            "lid::hinge", "revolute", 0, 0, PlanarPose(-0.4, 0.15), 1.0, (1.0, 0.0), 0.0, pi / 2
        )
        case = Body("object", None, (rectangle(-0.4, 0.4, -0.15, 0.15),))
        lid = Body("lid", 0, (rectangle(0.0, 0.8, 0.0, 0.04),))
        tree = ComponentTree(
            (Component("object", None, None, (case,)), Component("lid", 0, hinge, (lid,))),
            frozenset({("lid", "object")}),
        )
        start, goal = np.array([-1.8, -0.3, 0.0, 1.5]), np.array([1.8, -0.3, 0.0])
        return PlanningProblem(floor, tree, start, goal, (1.5,), settings=settings)
