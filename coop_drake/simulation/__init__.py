"""Run a scenario: the simulation, its log, and the invariants checked while it runs."""

from coop_drake.simulation.clearance import Clearance, TeamClearance
from coop_drake.simulation.log import SimulationLog

__all__ = ["Clearance", "SimulationLog", "TeamClearance"]
