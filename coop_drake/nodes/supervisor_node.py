"""The supervisor: cell planner and hold supervisor, computed at samples that the world gives."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from coop_drake.diagram.hold import add_supervisor
from coop_drake.messages import Hold, HoldRequest, Ready, Switch
from coop_drake.nodes.sampled import SampledDiagram
from coop_drake.scenario import Hold as HoldSettings
from coop_drake.systems import CellPlanner
from coop_drake.tree.pose import FloatArray

_NOTHING = np.array([-1.0, -1.0])
"""What is heard of a robot before its first message, as in a clear channel."""


class SupervisorNode:
    """Switches the cells of a team and holds it, by what robots report.

    Args:
        robots: Number of robots N.
        cells: Number of cells of the plan.
        period: Control period [s].
        hold: When the team is held, None for never.
    """

    def __init__(self, robots: int, cells: int, period: float, hold: HoldSettings | None) -> None:
        builder, self._period = DiagramBuilder(), period
        planner = builder.AddNamedSystem("cell_planner", CellPlanner(robots, cells, period=period))
        for k in range(robots):
            builder.ExportInput(planner.GetInputPort(f"robot_{k}_ready"), f"robot_{k}_ready")
        for name in ("current_cell", "arrived"):
            builder.ExportOutput(planner.GetOutputPort(name), name)
        self._held = hold is not None
        if hold is not None:
            supervisor = add_supervisor(builder, hold, planner, robots, period)
            for k in range(robots):
                builder.ExportInput(supervisor.GetInputPort(f"robot_{k}_request"), f"robot_{k}_request")
            for name in ("hold_message", "causes"):
                builder.ExportOutput(supervisor.GetOutputPort(name), name)
        self._sampled = SampledDiagram(builder.Build())
        self._logged = ("current_cell", "arrived", *(["causes"] if self._held else []))
        subjects = ("ready", *(["request"] if self._held else []))
        self._heard = {f"robot_{k}_{subject}": _NOTHING for k in range(robots) for subject in subjects}
        self._cell = 0

    def look(self, time: float) -> FloatArray:
        """Return the supervisor's record for the log at an instant [s]; nothing changes."""
        self._sampled.at(time, self._heard)
        return np.concatenate([self._sampled.output(name) for name in self._logged])

    def step(self, time: float) -> list[Switch | Hold]:
        """Compute a sample, and return what all robots are told."""
        self._sampled.at(time, self._heard)
        self._sampled.update()
        said: list[Switch | Hold] = []
        cell, entry = self._sampled.output("current_cell")
        if int(cell) != self._cell:
            self._cell = int(cell)
            said.append(Switch(self._cell, round(entry / self._period)))
        if self._held:
            held, number = self._sampled.output("hold_message")
            said.append(Hold(bool(held), int(number)))
        return said

    def hear(self, robot: int, messages: Iterable[Any]) -> None:
        """Take in what a robot says; it counts from the next instant on."""
        for message in messages:
            if isinstance(message, Ready):
                self._heard[f"robot_{robot}_ready"] = np.array([message.cell, 0.0 if message.ready else -1.0])
            elif isinstance(message, HoldRequest):
                self._heard[f"robot_{robot}_request"] = np.array(message, dtype=float)

    def release(self) -> None:
        """Free all memory."""
        self._sampled.release()
