"""A whole run of a sampled team as one compiled function, for millions of runs."""

from coop_drake.compiled_loop.preparing import CompiledTransport, prepare, with_gains
from coop_drake.compiled_loop.running import RunOutcome, run

__all__ = ["CompiledTransport", "RunOutcome", "prepare", "run", "with_gains"]
