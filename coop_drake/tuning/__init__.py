"""Tuning: an optimiser chooses a scenario's gains by named criteria, measured in simulated runs."""

from coop_drake.tuning.objective import (
    CRITERIA,
    Criterion,
    GainTrial,
    Limit,
    Objective,
    TrialOutcome,
    read_weights,
)
from coop_drake.tuning.search import Parameter, Search, TrialRunner, Workers, search, tunable_parameters

__all__ = [
    "CRITERIA",
    "Criterion",
    "GainTrial",
    "Limit",
    "Objective",
    "Parameter",
    "Search",
    "TrialOutcome",
    "TrialRunner",
    "Workers",
    "read_weights",
    "search",
    "tunable_parameters",
]
