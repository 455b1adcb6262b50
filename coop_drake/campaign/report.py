"""The measured columns of a table of runs, how they are called and shown, and which rows belong together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coop_drake.tree.pose import FloatArray, IntArray


@dataclass(frozen=True)
class Measure:
    """A column of numbers that a run leaves.

    Attributes:
        name: Name of the column.
        label: Name in tables and figures.
        unit: Unit in which it is shown.
        factor: Shown number over that of the column [-].
        margin: Whether it is a distance to a limit: less is worse, and zero is lost.
    """

    name: str
    label: str
    unit: str
    factor: float
    margin: bool

    def shown(self, number: float) -> str:
        """A number of the column in the unit shown, with three significant digits; empty for NaN."""
        value = self.factor * number
        if np.isnan(value):
            return ""
        return significant(value)


def significant(value: float, digits: int = 3) -> str:
    """A number with some significant digits, and whole from 100 on."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.{digits}g}"


SHARE = "budget_share"
"""Name of the column that is lost beyond one, not below zero."""

MARGINS = (
    Measure("funnel_margin", "axis to the bound of its funnel", "mrad or mm", 1e3, True),
    Measure("cell_margin", "object to the boundary of its cell", "mm", 1e3, True),
    Measure("wall_clearance", "bodies to walls", "mm", 1e3, True),
    Measure("body_clearance", "bodies to bodies", "mm", 1e3, True),
)
"""Distances to what a run must not touch."""

COSTS = (
    Measure("time", "time to arrival", "s", 1.0, False),
    Measure("peak_force", "largest base force", "N", 1.0, False),
    Measure("peak_torque", "largest torque", "N m", 1.0, False),
    Measure(SHARE, "used of what the budget states", "%", 100.0, False),
)
"""What a run takes."""

MEASURES = (*MARGINS, *COSTS)


class Runs:
    """A table of runs as arrays.

    Args:
        table: A pyarrow table with the columns of ``RunRecord``.
    """

    def __init__(self, table: Any) -> None:
        self._table = table
        self.count: int = table.num_rows
        self.lost = ~np.asarray(table["arrived"].to_numpy(), dtype=bool)

    def floats(self, name: str) -> FloatArray:
        """Return a column of numbers, shape (runs,); NaN where a run has none."""
        return np.asarray(self._table[name].to_numpy(), dtype=float)

    def integers(self, name: str) -> IntArray:
        """Return a column of whole numbers, shape (runs,)."""
        return np.asarray(self._table[name].to_numpy(), dtype=np.int64)

    def texts(self, name: str) -> list[str]:
        """Return a column of texts."""
        return [str(text) for text in self._table[name].to_pylist()]

    def text(self, name: str, row: int) -> str:
        """Return the text of a column in one row."""
        return str(self._table[name][int(row)].as_py())

    @cached_property
    def trials(self) -> IntArray:
        """The trial of every row, shape (runs,): runs of one scenario and index in two tiers are one."""
        numbers = self.integers("run")
        scenarios = np.empty(self.count, dtype=np.int64)
        names = sorted({scenario for scenario, _, _ in self.groups})
        for scenario, _, rows in self.groups:
            scenarios[rows] = names.index(scenario)
        pairs = scenarios * (numbers.max(initial=0) + 1) + numbers
        return np.asarray(np.unique(pairs, return_inverse=True)[1], dtype=np.int64)

    def count_trials(self, chosen: NDArray[np.bool_] | None = None) -> int:
        """Return how many trials have a chosen row; by default, all trials."""
        return int(np.unique(self.trials if chosen is None else self.trials[chosen]).size)

    @cached_property
    def groups(self) -> tuple[tuple[str, str, IntArray], ...]:
        """Scenario, tier and row numbers of the runs that belong together, sorted by name."""
        names = [self._table[name].combine_chunks().dictionary_encode() for name in ("scenario", "tier")]
        codes = [np.asarray(name.indices.to_numpy(zero_copy_only=False)) for name in names]
        first, second = ([str(text) for text in name.dictionary.to_pylist()] for name in names)
        found = []
        for scenario, tier in sorted((one, two) for one in first for two in second):
            rows = np.flatnonzero((codes[0] == first.index(scenario)) & (codes[1] == second.index(tier)))
            if rows.size:
                found.append((scenario, tier, rows))
        return tuple(found)
