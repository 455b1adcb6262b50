"""Run a scenario: the simulation, its log, and the invariants checked while it runs."""

from coop_drake.simulation.clearance import Clearance, TeamClearance
from coop_drake.simulation.invariants import ACCELERATION_TOLERANCE, WRENCH_TOLERANCE, Invariants, Margins
from coop_drake.simulation.ledger import Ledger, communication
from coop_drake.simulation.log import SimulationLog
from coop_drake.simulation.maps import build_maps, certificate_rows
from coop_drake.simulation.run import configure_simulator, simulate
from coop_drake.simulation.telemetry import Sample

__all__ = [
    "ACCELERATION_TOLERANCE",
    "WRENCH_TOLERANCE",
    "Clearance",
    "Invariants",
    "Ledger",
    "Margins",
    "Sample",
    "SimulationLog",
    "TeamClearance",
    "build_maps",
    "certificate_rows",
    "communication",
    "configure_simulator",
    "simulate",
]
