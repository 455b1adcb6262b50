"""Floor plans from elsewhere: drawings and occupancy maps read on the safe side, walls never smaller."""

from coop_drake.floor_plans.picture import save_picture
from coop_drake.floor_plans.plan import ENDINGS, FloorPlan, excess, read_floor_plan
from coop_drake.floor_plans.rooms import Inside
from coop_drake.floor_plans.settings import UNITS, FloorPlanSettings

__all__ = [
    "ENDINGS",
    "UNITS",
    "FloorPlan",
    "FloorPlanSettings",
    "Inside",
    "excess",
    "read_floor_plan",
    "save_picture",
]
