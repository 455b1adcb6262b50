"""An independent check of the planner's answers, plans and proofs of infeasibility, by sweeps of its own."""

from coop_drake.verification.checks import Check, Verified
from coop_drake.verification.found import verify_plan
from coop_drake.verification.infeasible import verify_proof
from coop_drake.verification.saved import verify_file

__all__ = ["Check", "Verified", "verify_file", "verify_plan", "verify_proof"]
