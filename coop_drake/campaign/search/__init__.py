"""Search for departures with which runs are lost: the worst within bounds, and how far beyond them."""

from coop_drake.campaign.search.findings import BreakingPoint, Finding

__all__ = ["BreakingPoint", "Finding"]
