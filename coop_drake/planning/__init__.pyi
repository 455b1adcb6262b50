from .boxes.channel import Channel, FreeBox, NoChannel
from .execution.estimate import plan_time
from .execution.transitions import make_plan, reschedule
from .search.search import find_channel

__all__ = [
    "Channel",
    "FreeBox",
    "NoChannel",
    "find_channel",
    "make_plan",
    "plan_time",
    "reschedule",
]
