"""What a diagnosis says: plain data, nothing in it that was not computed."""

from __future__ import annotations

from dataclasses import dataclass

from coop_drake.answers.mixed_cell import MixedCell
from coop_drake.diagnosis.blocking import Passage
from coop_drake.diagnosis.bodies import WithoutWalls
from coop_drake.diagnosis.bracket import Bracket
from coop_drake.diagnosis.contacts import Contact, Overlap
from coop_drake.diagnosis.relaxations import Relaxation
from coop_drake.diagnosis.trials import Answer
from coop_drake.tree.pose import FloatArray

__all__ = ["BlockedPose", "Diagnosis", "PassageFindings"]


@dataclass(frozen=True)
class PassageFindings:
    """What blocks the way from start to goal.

    Attributes:
        growth: How far every wall must move back [m].
        way: A way on the floor with so much more room, shape (m, 3 + n), None if there is none.
        needed: How far that way sticks out of the floor as it is, sampled, not proved [m].
        passages: The passages that block, in the order of the way.
        are_enough: Whether widening these passages alone was found enough.
        bare: What is known without walls, asked where no growth was found enough.
    """

    growth: Bracket
    way: FloatArray | None = None
    needed: float | None = None
    passages: tuple[Passage, ...] = ()
    are_enough: bool = False
    bare: WithoutWalls | None = None


@dataclass(frozen=True)
class BlockedPose:
    """A goal at which the team collides whatever its free joints.

    Attributes:
        configuration: The least bad configuration at the goal among those tried, shape (3 + n,).
        contacts: What sticks out of the floor there.
        overlaps: Bodies that overlap there.
        retreat: How far every wall must move back for the goal to be free of walls and bodies [m].
    """

    configuration: FloatArray
    contacts: tuple[Contact, ...]
    overlaps: tuple[Overlap, ...]
    retreat: Bracket


@dataclass(frozen=True)
class Diagnosis:
    """Why there is no plan, or that there is one.

    Attributes:
        answer: What the planner answers to the question as it is.
        reason: Its reason in a sentence, empty if it found a channel.
        margin: Margin of the channel found, None if none was [m].
        passages: What blocks the way, None if nothing does or the goal itself is blocked.
        goal: What blocks the goal, None if nothing does.
        relaxations: Changes to the team that were tried.
        mixed: For an undecided question what remained neither free nor blocked, the widest first.
        slices: Slices that the whole diagnosis took.
    """

    answer: Answer
    reason: str
    margin: float | None = None
    passages: PassageFindings | None = None
    goal: BlockedPose | None = None
    relaxations: tuple[Relaxation, ...] = ()
    mixed: tuple[MixedCell, ...] = ()
    slices: int = 0
