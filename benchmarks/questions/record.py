"""What a planning question leaves: one row of a Parquet file."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

MEASURED = "_seconds"
"""How names of columns end that a second answer to the same question does not repeat."""


@dataclass(frozen=True)
class QuestionRecord:
    """One planning question. Columns that end in ``_seconds`` were measured, and differ between machines.

    Attributes:
        question: Index in the campaign.
        seed: Seed of the question.
        floor: Kind of floor.
        robots: Number of robots.
        joints: Number of joints of the whole team.
        kind: Shape of the object, and whether any joint slides.
        verdict: ``plan``, ``beyond limits``, ``infeasible``, ``undecided``, or ``failed`` where the planner
            raised an error.
        cpu_seconds: Processor time of the planner [s].
        first_plan_seconds: Processor time until the first plan was certified; NaN if none was [s].
        cells: Cells of the plan.
        verified: Whether the exact checker accepted the answer; false for ``undecided``.
        sampled_margin: Smallest clearance of configurations sampled along the plan; NaN without one [m].
        peer: The other planners that searched for a way; the last one found it if any did. Empty if none did.
        peer_found: Whether one was found.
        peer_seconds: Processor time of the other planners together; NaN if none searched [s].
        reason: Why the question is undecided, beyond limits, or its answer wrong, or that the time limit
            ended the improvement of its plan; else empty.
        corners: Number of corners of the floor.
        width_ratio: Width of the floor's passages over that of the narrowest straight corridor in which the
            team is known to fit; NaN on floors without passages of one width [-].
    """

    question: int
    seed: int
    floor: str
    robots: int
    joints: int
    kind: str
    verdict: str
    cpu_seconds: float = nan
    first_plan_seconds: float = nan
    cells: int = 0
    verified: bool = False
    sampled_margin: float = nan
    peer: str = ""
    peer_found: bool = False
    peer_seconds: float = nan
    reason: str = ""
    corners: int = 0
    width_ratio: float = nan

    @property
    def is_wrong(self) -> bool:
        """Whether the answer is shown to be wrong: refused, refuted by a path, in contact, or an error."""
        if self.verdict == "undecided":
            return False
        refuted = self.verdict == "infeasible" and self.peer_found
        return not self.verified or refuted or self.sampled_margin <= 0.0
