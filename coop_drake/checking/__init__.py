"""A checker of plans and proofs in exact arithmetic, with nothing but the standard library."""

from coop_drake.checking.check import check
from coop_drake.checking.plane import RefusedError

__all__ = ["RefusedError", "check"]
