"""Gain advice: an optimiser chooses a scenario's gains against named criteria, judged by the closed loop."""

from coop_drake.tuning.criteria import CRITERIA, Criterion
from coop_drake.tuning.knobs import Knob, knobs_of
from coop_drake.tuning.objective import Limit, Objective, read_weights
from coop_drake.tuning.search import Search, search
from coop_drake.tuning.trial import Outcome, Trial, Workbench
from coop_drake.tuning.workers import Workers
from coop_drake.tuning.writing import TUNED, write_gains, write_trials

__all__ = [
    "CRITERIA",
    "TUNED",
    "Criterion",
    "Knob",
    "Limit",
    "Objective",
    "Outcome",
    "Search",
    "Trial",
    "Workbench",
    "Workers",
    "knobs_of",
    "read_weights",
    "search",
    "write_gains",
    "write_trials",
]
