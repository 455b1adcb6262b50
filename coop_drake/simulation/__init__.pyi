from .clearance import TeamClearance
from .maps import accuracy_rows, build_maps
from .run import configure_simulator, run_loop, simulate
from .telemetry import (
    ACCELERATION_TOLERANCE,
    WRENCH_TOLERANCE,
    Invariants,
    Margins,
    MessageStatistics,
    Sample,
    communication,
)

__all__ = [
    "ACCELERATION_TOLERANCE",
    "WRENCH_TOLERANCE",
    "Invariants",
    "Margins",
    "MessageStatistics",
    "Sample",
    "TeamClearance",
    "accuracy_rows",
    "build_maps",
    "communication",
    "configure_simulator",
    "run_loop",
    "simulate",
]
