"""Writes the results of tuning: the gain set as YAML for ``--gains``, and every trial as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from coop_drake.files import write_atomically
from coop_drake.laws import GainSet
from coop_drake.scenario import dump_gains
from coop_drake.tuning.search import Search

TUNED = "tuned"
"""Name of the gain set that tuning writes."""


def write_gains(gains: GainSet, remarks: Sequence[str], path: Path) -> Path:
    """Write a gain set with comments before it, one line each."""
    comments = "".join(f"# {remark}\n" for remark in remarks)
    return write_atomically(path, (comments + dump_gains(TUNED, gains)).encode())


def write_trials(found: Search, path: Path) -> Path:
    """Write every trial in the order of the search, the run before tuning first."""
    rows = []
    for trial, score in zip(found.trials, found.scores, strict=True):
        outcome = asdict(trial.outcome)
        outcome["share_done"] = outcome.pop("fraction_done")
        rows.append({"score": score, **outcome, "gains": asdict(trial.gains)})
    document = {
        "weights": dict(found.objective.weights),
        "limits": [asdict(limit) for limit in found.objective.limits],
        "best": found.trials.index(found.best),
        "trials": rows,
    }
    return write_atomically(path, json.dumps(document, indent=1).encode() + b"\n")
