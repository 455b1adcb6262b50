"""Campaigns: many runs by seed, placed on the cores of one machine or of many, with nothing lost."""

from coop_drake.campaign.file import Campaign, Runs, load_campaign
from coop_drake.campaign.records import RunRecord, schema_of, table_of

__all__ = ["Campaign", "RunRecord", "Runs", "load_campaign", "schema_of", "table_of"]
