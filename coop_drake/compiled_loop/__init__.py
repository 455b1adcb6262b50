"""The closed loop as compiled code, for millions of runs: one call is a whole transport."""

from coop_drake.compiled_loop.preparing import CompiledTransport, prepare
from coop_drake.compiled_loop.running import RunOutcome, run, run_many

__all__ = ["CompiledTransport", "RunOutcome", "prepare", "run", "run_many"]
