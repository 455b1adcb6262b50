"""Counts the messages that the robots and the cell planner of a run exchange."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.answers.log import SimulationLog


@dataclass(frozen=True)
class MessageStatistics:
    """The messages of one transport if a message is sent only when its content changes.

    Attributes:
        reports: Reports of every robot to the cell planner, shape (N,).
        announcements: New cells, announced by the cell planner to each robot.
    """

    reports: tuple[int, ...]
    announcements: int

    @property
    def messages(self) -> int:
        """Number of all messages of the team."""
        return sum(self.reports) + self.announcements


def communication(log: SimulationLog) -> MessageStatistics:
    """Count the messages that a run needed.

    A robot reports when it becomes ready to leave the current cell, and when it is no longer ready. After a
    switch to the next cell no report is needed, because every robot then counts as not ready. The cell
    planner announces each cell but the first to every robot.
    """
    ready = log.ready_margins >= 0.0
    entered = np.diff(log.cell_index, prepend=-1) != 0
    before = np.vstack([np.zeros_like(ready[:1]), ready[:-1]])
    before[entered] = False
    reports = (ready != before).sum(axis=0)
    announcements = (int(entered.sum()) - 1) * len(reports)
    return MessageStatistics(tuple(int(count) for count in reports), announcements)
