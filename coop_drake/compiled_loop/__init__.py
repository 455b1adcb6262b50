"""The closed loop as compiled code, for many runs: whole transports, or the controllers in Drake's loop."""

from coop_drake.compiled_loop.drakes_loop import (
    SampledLoop,
    build_fused_loop,
    build_sampled_loop,
    simulate_fused,
    simulate_sampled,
)
from coop_drake.compiled_loop.preparing import CompiledTransport, prepare, with_gains
from coop_drake.compiled_loop.running import RunOutcome, run, run_many

__all__ = [
    "CompiledTransport",
    "RunOutcome",
    "SampledLoop",
    "build_fused_loop",
    "build_sampled_loop",
    "prepare",
    "run",
    "run_many",
    "simulate_fused",
    "simulate_sampled",
    "with_gains",
]
