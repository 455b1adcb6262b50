"""The findings of a diagnosis: plain data, all of it computed."""

from __future__ import annotations

from dataclasses import dataclass

from coop_drake.answers.mixed_cell import MixedCell
from coop_drake.diagnosis.bracket import Bracket
from coop_drake.diagnosis.contacts import Contact, Overlap
from coop_drake.diagnosis.open_floor import OpenFloor
from coop_drake.diagnosis.passages import BlockingPassage
from coop_drake.diagnosis.relaxations import Relaxation
from coop_drake.diagnosis.variants import Answer
from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class PassageFindings:
    """What blocks every path from start to goal.

    Attributes:
        widening: How far every wall must move back [m].
        path: A path on the floor that is wider by so much, shape (m, 3 + n), None if there is none.
        needed: How far that path leaves the floor as it is, at its configurations, not proved [m].
        passages: The passages that block, in the order of the path.
        are_enough: Whether a channel was found with only these passages widened.
        open_floor: What is known without walls, where no widening was enough.
    """

    widening: Bracket
    path: FloatArray | None = None
    needed: float | None = None
    passages: tuple[BlockingPassage, ...] = ()
    are_enough: bool = False
    open_floor: OpenFloor | None = None


@dataclass(frozen=True)
class BlockedPose:
    """A goal at which the team collides whatever its free joints.

    Attributes:
        configuration: The configuration at the goal with the least collision of those tried, shape (3 + n,).
        contacts: Which bodies leave the floor there.
        overlaps: Bodies that overlap there.
        widening: How far every wall must move back for the team to be free at the goal [m].
    """

    configuration: FloatArray
    contacts: tuple[Contact, ...]
    overlaps: tuple[Overlap, ...]
    widening: Bracket


@dataclass(frozen=True)
class Diagnosis:
    """Why there is no plan, or that there is one.

    Attributes:
        answer: What the planner answers to the problem as it is.
        reason: Its reason in a sentence, empty if it found a channel.
        passages: What blocks every path, None if nothing does or the goal itself is blocked.
        goal: What blocks the goal, None if nothing does.
        relaxations: Changes to the team that were tried.
        mixed: For an undecided problem the cells neither proved free nor blocked, the widest first.
        slices: Slices that the whole diagnosis took.
    """

    answer: Answer
    reason: str
    passages: PassageFindings | None = None
    goal: BlockedPose | None = None
    relaxations: tuple[Relaxation, ...] = ()
    mixed: tuple[MixedCell, ...] = ()
    slices: int = 0
