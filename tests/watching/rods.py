"""Recordings of a rod that must pass a corridor: small enough to record and draw in a test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.component_tree import Component, ComponentTree, PlanarPose, TreeJoint
from coop_drake.watching import SearchRecording, Strategy, record_search
from tests.planning.test_search import rod_problem

WIDE, NARROW = 0.22, 0.198
"""Widths of the corridor in which the rod, 0.2 m broad, gets through and does not [m]."""


def rod_recording(corridor: float = WIDE, strategy: Strategy = "cells") -> SearchRecording:
    """Record the search for the rod's path."""
    return record_search(rod_problem(corridor), strategy)


def jointed_rod() -> PlanningProblem:
    """The rod with a joint that must turn though it moves no solid body."""
    problem = rod_problem(WIDE)
    joint = TreeJoint("rod::idle", "revolute", 0, 0, PlanarPose(), 1.0, (1.0, 0.0), -1.0, 1.0)
    bare = Component("bare", 0, joint, ())
    tree = ComponentTree((*problem.tree.components, bare), frozenset())
    return replace(problem, tree=tree, start=np.append(problem.start, 0.8), goal_joints=(-0.8,))
