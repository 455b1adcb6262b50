"""What two processes must have alike before they speak, and why one of them may be turned away."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

TAKEN, OTHER_SCENARIO, OTHER_PLAN, OTHER_KEY, OTHER_VERSION = 1, 2, 3, 4, 5
"""Reasons of ``TurnedAway``."""

REASONS = {
    TAKEN: "another process of this name is being heard",
    OTHER_SCENARIO: "it has another scenario",
    OTHER_PLAN: "it has another plan",
    OTHER_KEY: "its address book has another key for this name",
    OTHER_VERSION: "it speaks another version of the protocol",
}
"""The reasons in words, said by the one that is turned away."""

Tap = Callable[[str, int, bytes], object]
"""Is shown every message: ``received`` or ``sent``, the index of the peer, -1 if unknown, and the bytes."""


class Question(NamedTuple):
    """What both ends of a channel must agree on.

    Attributes:
        scenario: First eight bytes of a digest of the scenario, as a number.
        plan: The same of the plan.
    """

    scenario: int = 0
    plan: int = 0


ANY_QUESTION = Question()
"""Where nothing must agree."""
