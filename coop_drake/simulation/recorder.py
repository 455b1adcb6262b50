"""Collects samples and margins into a log."""

from __future__ import annotations

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
        z, rates = self._samples("z"), self._samples("rates")
        return SimulationLog(
            times=self._samples("time"),
            cell_index=np.array([sample.cell for sample, _ in self._rows], dtype=np.int64),
            transition_start=self._samples("entry"),
            object_pose=z[:, :3],
            object_twist=rates[:, :3],
            base_poses=self._samples("base_poses"),
            joints=z[:, 3:],
            joint_rates=rates[:, 3:],
            accelerations=self._samples("accelerations"),
            governor_position=self._samples("governor_position"),
            governor_spread=self._samples("governor_spread"),
            funnel_lower=self._samples("funnel_lower"),
            funnel_upper=self._samples("funnel_upper"),
            energy_margin=self._samples("energy_margin"),
            object_wrench=self._samples("object_wrench"),
            commanded_wrenches=self._samples("commanded_wrenches"),
            measured_wrenches=self._samples("measured_wrenches"),
            grasp_error=self._samples("grasp_error"),
            base_wrenches=self._samples("base_wrenches"),
            joint_torques=self._samples("joint_torques"),
            ready_margins=self._samples("ready_margins"),
            held=self._samples("held"),
            clock_lag=self._samples("clock_lag"),
            workspace_clearance=self._margins("workspace_clearance"),
            body_clearance=self._margins("body_clearance"),
            cell_clearance=self._margins("cell_clearance"),
            funnel_margin=self._margins("funnel_margin"),
            slice_margin=self._margins("slice_margin"),
            acceleration_error=self._margins("acceleration_error"),
            wrench_error=self._margins("wrench_error"),
            **ends,
        )

    def _samples(self, name: str) -> FloatArray:
        return np.array([getattr(sample, name) for sample, _ in self._rows], dtype=float)

    def _margins(self, name: str) -> FloatArray:
        return np.array([getattr(margins, name) for _, margins in self._rows], dtype=float)
