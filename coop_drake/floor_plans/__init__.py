"""Reads drawings and occupancy maps as workspaces; their formats stand in `formats.py`."""

from coop_drake.floor_plans.formats import SUFFIXES
from coop_drake.floor_plans.picture import save_picture
from coop_drake.floor_plans.plan import FloorPlan, excess, read_floor_plan
from coop_drake.floor_plans.rooms import Inside
from coop_drake.floor_plans.settings import UNITS, FloorPlanSettings

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
