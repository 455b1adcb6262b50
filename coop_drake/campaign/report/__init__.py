"""The report of a campaign: rates with their bounds, distributions, the worst runs, as a page and as JSON."""

from coop_drake.campaign.report.document import Report, make_report
from coop_drake.campaign.report.page import write_report

__all__ = ["Report", "make_report", "write_report"]
