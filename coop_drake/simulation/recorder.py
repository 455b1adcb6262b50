"""Collects samples and margins into a log."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.simulation.invariants import Margins
from coop_drake.simulation.telemetry import Sample
from coop_drake.tree.pose import FloatArray


class Recorder:
    """Collects the accepted steps of a run."""

    def __init__(self) -> None:
        self._rows: list[tuple[Sample, Margins]] = []

    def add(self, sample: Sample, margins: Margins) -> None:
        """Add one step."""
        self._rows.append((sample, margins))

    def to_log(self, **ends: Any) -> SimulationLog:
        """Return the log of all steps.

        Args:
            ends: The log's fields from ``reached`` on, which are the same for all steps.
        """
        z, rates = self._column("z"), self._column("rates")
        known = {field.name for kind in (Sample, Margins) for field in fields(kind)} - set(ends)
        names = [field.name for field in fields(SimulationLog) if field.name in known]
        arrays: dict[str, Any] = {name: self._column(name) for name in names}
        return SimulationLog(
            times=self._column("time"),
            cell_index=self._column("cell").astype(np.int64),
            transition_start=self._column("entry"),
            object_pose=z[:, :3],
            object_twist=rates[:, :3],
            joints=z[:, 3:],
            joint_rates=rates[:, 3:],
            **arrays,
            **ends,
        )

    def _column(self, name: str) -> FloatArray:
        """Return a field of the margins of all steps, or else of their samples."""
        rows = [margins if hasattr(margins, name) else sample for sample, margins in self._rows]
        return np.array([getattr(row, name) for row in rows], dtype=float)
