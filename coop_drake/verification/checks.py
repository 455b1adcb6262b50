"""What a verification looked at: one line for every kind of claim."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["Check", "Progress", "Verified"]

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Check:
    """One kind of claim that was found to hold.

    Attributes:
        name: What holds, in words.
        count: How often it was checked.
        tightest: The figure closest to a refusal, None where there is none.
        unit: Its unit, with what it measures.
    """

    name: str
    count: int
    tightest: float | None = None
    unit: str = ""


@dataclass(frozen=True)
class Verified:
    """A certificate that holds.

    Attributes:
        answer: ``found`` or ``infeasible``.
        subject: What was verified, in words.
        checks: What was looked at.
    """

    answer: str
    subject: str
    checks: tuple[Check, ...]
