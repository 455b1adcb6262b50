"""Tuning: an optimiser chooses a scenario's gains by named criteria, measured in simulated runs."""

from coop_drake.tuning.criteria import CRITERIA, Criterion
from coop_drake.tuning.objective import Limit, Objective, read_weights
from coop_drake.tuning.parameters import Parameter, tunable_parameters
from coop_drake.tuning.search import Search, search
from coop_drake.tuning.trial import GainTrial, RunOutcome, TrialRunner
from coop_drake.tuning.workers import Workers
from coop_drake.tuning.writing import TUNED, write_gains, write_trials

__all__ = [
    "CRITERIA",
    "TUNED",
    "Criterion",
    "GainTrial",
    "Limit",
    "Objective",
    "Parameter",
    "RunOutcome",
    "Search",
    "TrialRunner",
    "Workers",
    "read_weights",
    "search",
    "tunable_parameters",
    "write_gains",
    "write_trials",
]
