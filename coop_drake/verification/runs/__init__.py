"""An independent check of a run by its log: what was logged must follow from the plan and from mechanics."""

from coop_drake.verification.runs.budget import budget_share, largest_departure
from coop_drake.verification.runs.rows import BodyMass, Rows, RunSetup
from coop_drake.verification.runs.verify_log import verify_log

__all__ = ["BodyMass", "Rows", "RunSetup", "budget_share", "largest_departure", "verify_log"]
