"""The section ``questions`` of a campaign file: random planning questions, and how answers are judged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from coop_drake.campaign.file import Seed
from coop_drake.typed_data import DataError, Limits, NotNegative, Positive

FloorKind = Literal["room", "corridor", "door", "warehouse", "rooms"]

Count = Annotated[int, Limits(above=0)]


@dataclass(frozen=True)
class QuestionSettings:
    """Random planning questions.

    Attributes:
        count: How many are asked.
        seeds: Seeds of all that is drawn, which questions take by turns; the seed and its number determine a
            question.
        floors: Kinds of floors; each is as frequent as the others.
        robots: Numbers of robots; each is a third as frequent as the one before.
        most_joints: Largest number of joints of a robot; each number is a third as frequent as the one
            before.
        time_limit: A question without a certified way after this time counts as undecided; with one, its plan
            is finished and not improved any more [CPU s].
        samples: Configurations of every cell at which the distances of a plan are computed.
        peer_time: How long the other planners search for a path where it is proved that none exists, each
            the same time, together so long [CPU s].
        patient_peer_time: How long they search likewise where the answer is undecided [CPU s].
        batch: Questions that one process answers, and one file holds.
    """

    count: Count = 100
    seeds: tuple[Seed, ...] = (0,)
    floors: tuple[FloorKind, ...] = ("room", "corridor", "door", "warehouse", "rooms")
    robots: tuple[Annotated[int, Limits(at_least=2, at_most=5)], ...] = (2, 3, 4, 5)
    most_joints: Annotated[int, Limits(at_least=1, at_most=3)] = 3
    time_limit: Positive = 60.0
    samples: Count = 40
    peer_time: NotNegative = 2.0
    patient_peer_time: NotNegative = 60.0
    batch: Count = 20

    def __post_init__(self) -> None:
        """Refuse lists without an entry."""
        for key in ("seeds", "floors", "robots"):
            if not getattr(self, key):
                raise DataError(key, [], "at least one entry")

    def seed(self, number: int) -> int:
        """Return the seed of a question."""
        return self.seeds[number % len(self.seeds)]

    @property
    def longest(self) -> float:
        """Time after which a process that answers one question counts as hanging [s].

        Processor time is limited by the other entries. A process on a busy machine gets a part of a
        processor, and checking an answer takes about as long as finding it.
        """
        return 10.0 * (2.0 * self.time_limit + max(self.peer_time, self.patient_peer_time)) + 600.0
