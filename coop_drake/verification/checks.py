"""The record of a verification: one entry for every kind of statement that was checked."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One kind of statement that was found to hold.

    Attributes:
        name: The statement, in words.
        count: How many times it was checked.
        tightest: The value that came closest to a refusal, None where there is none.
        unit: Its unit, with what it measures.
        arrays: Names of the log's arrays that were computed again, or are tied to others by equations: no
            number of them can be altered alone.
    """

    name: str
    count: int
    tightest: float | None = None
    unit: str = ""
    arrays: tuple[str, ...] = ()


@dataclass(frozen=True)
class Verified:
    """An answer of the planner that holds.

    Attributes:
        answer: ``found``, ``beyond limits`` or ``infeasible``.
        subject: What was verified, in words.
        checks: The statements that were checked.
        proved: What these prove together, in a sentence.
        not_proved: What they do not prove, in words.
    """

    answer: str
    subject: str
    checks: tuple[Check, ...]
    proved: str
    not_proved: str
