from .body_pairs import BodyPairs
from .boundary import BoundaryDistance
from .minkowski import FreeSpace
from .passage import Passage, PassageFinder, pole
from .simplify import sharpest_angle, simplify_inward
from .swept_tree import SweptTree
from .tidy import tidy_cell

__all__ = [
    "BodyPairs",
    "BoundaryDistance",
    "FreeSpace",
    "Passage",
    "PassageFinder",
    "SweptTree",
    "pole",
    "sharpest_angle",
    "simplify_inward",
    "tidy_cell",
]
