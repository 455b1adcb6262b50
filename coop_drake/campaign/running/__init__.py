"""Runs a campaign: batches in processes of their own, placed by Dask, on one machine or on many."""

from coop_drake.campaign.running.command import Outcome, run_campaign
from coop_drake.campaign.running.supervising import Order, make_batch

__all__ = ["Order", "Outcome", "make_batch", "run_campaign"]
