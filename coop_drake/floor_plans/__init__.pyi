from .picture import save_picture
from .plan import SUFFIXES, FloorPlan, excess, read_floor_plan
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
