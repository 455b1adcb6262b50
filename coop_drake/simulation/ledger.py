"""Counts what the robots told each other in a run."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from coop_drake.simulation.log import SimulationLog

__all__ = ["Ledger", "communication"]

#: A report on the air: the index of the cell that it is about, and whether its sender is ready to leave it.
REPORT = struct.Struct("<H?")
#: An announcement on the air: the index of the cell that is now the current one.
ANNOUNCEMENT = struct.Struct("<H")


@dataclass(frozen=True)
class Ledger:
    """The messages of one transport, were each sent only when it says something new.

    Attributes:
        reports: Reports of every robot to the cell planner, shape (N,).
        announcements: New cells, told by the cell planner to each robot.
        message_bytes: Payload of all of them [bytes].
    """

    reports: tuple[int, ...]
    announcements: int
    message_bytes: int

    @property
    def messages(self) -> int:
        """All messages of the team."""
        return sum(self.reports) + self.announcements


def communication(log: SimulationLog) -> Ledger:
    """Count the messages that a run needed.

    A robot reports when it becomes ready to leave the current cell, and when it takes that back; that it is
    not ready for a cell just entered goes without saying. The cell planner announces each cell but the first
    to every robot.

    Args:
        log: The run.
    """
    ready = log.ready_margins >= 0.0
    entered = np.diff(log.cell_index, prepend=-1) != 0
    before = np.vstack([np.zeros_like(ready[:1]), ready[:-1]])
    before[entered] = False
    reports = (ready != before).sum(axis=0)
    announcements = (int(entered.sum()) - 1) * len(reports)
    size = int(reports.sum()) * REPORT.size + announcements * ANNOUNCEMENT.size
    return Ledger(tuple(int(count) for count in reports), announcements, size)
