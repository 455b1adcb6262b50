"""Shapes of the floor and of the team: component tree, conservative sweeps, free space, tidy cells."""

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.geometry.minkowski import FreeSpace
from coop_drake.geometry.passage import Passage, PassageFinder, pole
from coop_drake.geometry.simplify import sharpest_angle, simplify_inward
from coop_drake.geometry.slits import cut_holes
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.geometry.tidy import tidy_cell

__all__ = [
    "BodyPairs",
    "BoundaryDistance",
    "FreeSpace",
    "Passage",
    "PassageFinder",
    "SweptTree",
    "cut_holes",
    "pole",
    "sharpest_angle",
    "simplify_inward",
    "tidy_cell",
]
