"""Wiring of what holds the team: the supervisor, and the order that a scenario schedules."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from coop_drake.scenario import Hold
from coop_drake.systems import CellPlanner, HoldSupervisor


def add_supervisor(
    builder: DiagramBuilder, hold: Hold, planner: CellPlanner, robots: int, period: float | None
) -> HoldSupervisor:
    """Add the supervisor with the scheduled order, and keep the team in its cell while it is held.

    Args:
        builder: Holds the cell planner.
        hold: When the team is held.
        planner: The cell planner.
        robots: Number of robots whose requests are heard.
        period: Control period [s], None in continuous time.
    """
    supervisor = builder.AddNamedSystem(
        "hold_supervisor", HoldSupervisor(robots, silence=hold.silence, period=period)
    )
    order = builder.AddNamedSystem("hold_order", _order(hold))
    builder.Connect(order.get_output_port(0), supervisor.GetInputPort("order"))
    builder.Connect(supervisor.GetOutputPort("paused"), planner.GetInputPort("paused"))
    return supervisor


def _order(hold: Hold) -> System:
    """Return the source of the order: 1 from each of the times on for the duration, else 0."""
    if not hold.at:
        return ConstantVectorSource([0.0])
    begins = np.array(sorted(hold.at))
    events = np.unique(
        np.concatenate([[0.0], begins, begins + hold.duration, [begins[-1] + 2.0 * hold.duration]])
    )
    told = [float(any(begin <= time < begin + hold.duration for begin in begins)) for time in events]
    return TrajectorySource(PiecewisePolynomial.ZeroOrderHold(events, np.array([told])))
