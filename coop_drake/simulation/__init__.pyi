from .clearance import Clearance, TeamClearance
from .invariants import ACCELERATION_TOLERANCE, WRENCH_TOLERANCE, Invariants, Margins
from .maps import accuracy_rows, build_maps
from .message_statistics import MessageStatistics, communication
from .run import configure_simulator, run_loop, simulate
from .telemetry import Sample

__all__ = [
    "ACCELERATION_TOLERANCE",
    "WRENCH_TOLERANCE",
    "Clearance",
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
