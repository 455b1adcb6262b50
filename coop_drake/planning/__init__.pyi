from .cells.cells import FreeBox
from .channel import Channel, NoChannel
from .duration import plan_time
from .search import find_channel
from .transitions import make_plan, reschedule

__all__ = [
    "Channel",
    "FreeBox",
    "NoChannel",
    "find_channel",
    "make_plan",
    "plan_time",
    "reschedule",
]
