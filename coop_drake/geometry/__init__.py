"""Shapes of the floor and of the team: component tree, conservative sweeps, free space, tidy cells."""

from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.geometry.passage import Passage, PassageFinder, pole
from coop_drake.geometry.simplify import sharpest_angle, simplify_inward
from coop_drake.geometry.slits import cut_holes
from coop_drake.geometry.tidy import tidy_cell

__all__ = [
    "BoundaryDistance",
    "Passage",
    "PassageFinder",
    "cut_holes",
    "pole",
    "sharpest_angle",
    "simplify_inward",
    "tidy_cell",
]
