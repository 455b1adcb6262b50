from .formats import SUFFIXES
from .picture import save_picture
from .plan import FloorPlan, excess, read_floor_plan
from .rooms import Inside
from .settings import UNITS, FloorPlanSettings

__all__ = [
    "SUFFIXES",
    "UNITS",
    "FloorPlan",
    "FloorPlanSettings",
    "Inside",
    "excess",
    "read_floor_plan",
    "save_picture",
]
