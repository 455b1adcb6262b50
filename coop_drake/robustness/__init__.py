"""How far a team may depart from its motion under a budget, and what its masses couple."""

from coop_drake.robustness.couplings import cell_couplings
from coop_drake.robustness.tracking import departures_of, moving_of

__all__ = ["cell_couplings", "departures_of", "moving_of"]
