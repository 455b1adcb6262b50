"""Check that cells were entered one by one, each when all robots were ready to leave the one before."""

from __future__ import annotations

import numpy as np

from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.funnels import entry_energies
from coop_drake.verification.runs.holds import paused
from coop_drake.verification.runs.readiness import rest_shares
from coop_drake.verification.runs.rows import Rows


def check_handovers(rows: Rows, *, exact: bool) -> tuple[Check, Check]:
    """Check order and times of the cells, and the reports with which each was left.

    An ideal team leaves a cell in the first row in which all robots are ready, unless it is held. Otherwise
    reports travel, and every robot must have reported to be ready at some time in the cell.

    Args:
        rows: The log.
        exact: Whether the team is ideal.
    """
    log, plan, last = rows.log, rows.plan, len(rows.log.times) - 1
    if log.cell_index[-1] != len(plan.cells) - 1:
        raise RefusalError(
            f"cell_index[{last}]", f"is {log.cell_index[-1]}; expected the last cell at the end"
        )
    entered = np.concatenate(([0.0], log.times[rows.entries]))
    rows.require_same("transition_start", entered[log.cell_index], 0.0)
    ready = log.ready_margins >= 0.0
    if exact:
        leaves = np.diff(log.cell_index, append=len(plan.cells)) > 0
        rows.require(ready.all(axis=1) | ~leaves, "cell_index", "is left although a robot is not ready")
        kept = leaves | paused(rows) | ~ready.all(axis=1)
        rows.require(kept, "cell_index", "is kept although all robots are ready")
    for k in range(len(plan.cells)):
        members = np.flatnonzero(log.cell_index == k)
        for robot in np.flatnonzero(~ready[members].any(axis=0)):
            where = f"ready_margins[{members[-1]}, {robot}]"
            text = f"and all before in cell {k} are negative, but the cell is left"
            raise RefusalError(where, f"at t = {log.times[members[-1]]:.6g} s: {text}")
    shares = [float(_share(rows, k, i).max()) for k, i in enumerate(rows.entries, 1)]
    used = "share of the energy, or of the departure from rest, that the axes may have when a cell is entered"
    return (
        Check(
            "cells were entered one by one, each when all robots were ready",
            len(shares),
            arrays=("cell_index", "transition_start"),
        ),
        Check(used, len(shares), max(shares, default=None), "of the bound, largest"),
    )


def _share(rows: Rows, cell: int, row: int) -> FloatArray:
    """Energy of every axis, or departure from rest, over its bound when a cell is entered, shape (1 + n,)."""
    if rows.plan.transitions[cell - 1].gains.rest is not None:
        return rest_shares(rows.plan, cell - 1, rows.z[row, 2:], rows.rates[row, 2:])
    energies = entry_energies(rows.plan, cell, rows.z[row, 2:], rows.rates[row, 2:])
    share: FloatArray = energies / rows.plan.transitions[cell].gains.energy_bound
    return share
