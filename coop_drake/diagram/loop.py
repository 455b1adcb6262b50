"""What all loops of a simulated team have in common."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.systems.framework import Context, Diagram

from coop_drake.answers.plan import Plan
from coop_drake.diagram.station import TransportStation
from coop_drake.plant import TeamPlant, set_configuration
from coop_drake.systems.block import release_all
from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class Loop:
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

    def release(self) -> None:
        """Free all memory after the last context is gone; no part of the loop may be used any more."""
        release_all(self.diagram)
