"""What all loops of a simulated team have in common, and how their ports are read for the log."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.framework import Context, Diagram, System

from coop_drake.answers.plan import Plan
from coop_drake.diagram.station import TransportStation
from coop_drake.plant import TeamPlant, set_configuration
from coop_drake.systems.block import release_all
from coop_drake.tree.pose import FloatArray


class PortRow:
    """The values of many ports in one row.

    Args:
        root: Context of the whole diagram; every reading is of its present content.
    """

    def __init__(self, root: Context) -> None:
        self._root = root
        self._readers: list[Callable[[], FloatArray]] = []
        self._size = 0

    def add(self, system: System, output: str) -> Any:
        """Append an output and return its indices in the row."""
        first = self._size
        self._readers.append(
            partial(system.GetOutputPort(output).Eval, system.GetMyContextFromRoot(self._root))
        )
        self._size += system.GetOutputPort(output).size()
        return np.arange(first, self._size)

    def read(self) -> FloatArray:
        """The present values of all ports."""
        return np.concatenate([read() for read in self._readers])


class Places(NamedTuple):
    """Indices in a row of ports of the parts of a sample, as integer arrays of the parts' shapes."""

    instant: Any
    base_poses: Any
    governors: Any
    funnel_lower: Any
    funnel_upper: Any
    energy_margins: Any
    commanded_wrenches: Any
    base_wrenches: Any
    joint_torques: Any
    accelerations: Any
    realised: Any
    ready_margins: Any
    clock_lag: Any
    causes: Any
    alarms: Any


@dataclass(frozen=True)
class Loop(ABC):
    """A simulated team with all that drives it.

    Attributes:
        diagram: The Diagram of everything.
        station: The simulated team.
        plan: The plan that is followed.
        start: Where the team stands at first, shape (3 + n,) [m, rad].
    """

    diagram: Diagram
    station: TransportStation
    plan: Plan
    start: FloatArray

    @property
    def team(self) -> TeamPlant:
        """The simulated team."""
        return self.station.team

    def create_context(self) -> Context:
        """Create a context of a team at rest."""
        context = self.diagram.CreateDefaultContext()
        team = self.team
        set_configuration(team, team.plant.GetMyMutableContextFromRoot(context), self.start)
        return context

    @abstractmethod
    def places(self, ports: PortRow) -> Places:
        """Add all outputs that are logged to a row, and return where they stand."""

    def realised(self, ports: PortRow) -> Any:
        """Add the accelerations of z in the plant to a row, and return where they stand, shape (3 + n,)."""
        return ports.add(self.station.diagram, "generalized_acceleration")[self.team.velocity_index]

    def release(self) -> None:
        """Free all memory after the last context is gone; no part of the loop may be used any more."""
        release_all(self.diagram)
