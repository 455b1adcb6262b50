"""An independent check of the planner's answers: plans, and proofs that no plan exists."""

from coop_drake.verification.answer import verify_file, verify_plan, verify_proof
from coop_drake.verification.checks import Check, Verified

__all__ = ["Check", "Verified", "verify_file", "verify_plan", "verify_proof"]
