from .minkowski import FreeSpace
from .passage import Passage, PassageFinder, pole
from .polygons import BoundaryDistance
from .simplify import sharpest_angle, simplify_inward, tidy_cell
from .swept_tree import BodyPairs, SweptTree

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
