"""From a problem to a plan, or to a proof that none exists."""

from coop_drake.planning.boxes.channel import Channel, FreeBox, NoChannel
from coop_drake.planning.execution.estimate import plan_time
from coop_drake.planning.execution.transitions import make_plan, reschedule
from coop_drake.planning.search.search import find_channel

__all__ = [
    "Channel",
    "FreeBox",
    "NoChannel",
    "find_channel",
    "make_plan",
    "plan_time",
    "reschedule",
]
