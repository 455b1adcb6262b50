"""An independent check of the planner's answers: plans, and proofs that no plan exists."""

from coop_drake.verification.checks import Check, Verified
from coop_drake.verification.exact import verify_plan, verify_proof
from coop_drake.verification.files import verify_file

__all__ = ["Check", "Verified", "verify_file", "verify_plan", "verify_proof"]
