"""An independent check of a run by its log: what was logged must follow from the plan and from mechanics."""

from coop_drake.verification.runs.rows import Rows
from coop_drake.verification.runs.setup import BodyMass, RunSetup
from coop_drake.verification.runs.tube import budget_share, largest_departure
from coop_drake.verification.runs.verify_log import verify_log

__all__ = ["BodyMass", "Rows", "RunSetup", "budget_share", "largest_departure", "verify_log"]
