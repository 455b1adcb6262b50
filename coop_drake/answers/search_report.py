"""The work that a search did before it answered."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class SearchReport:
    """The work of a search.

    Attributes:
        slices: Compound slices swept, all attempts together: those of explorations and the boxes that were
            tried along sampled paths.
        first_plan_cpu_seconds: Processor time until a channel was certified, whatever its margin, None if
            none was [s]. It decides nothing and makes no difference between reports.
        improvements: Processor time from the question to each plan that was the quickest so far, and its
            estimated duration, in the order found [s]. Not compared either.
    """

    slices: int
    first_plan_cpu_seconds: float | None = field(default=None, compare=False)
    improvements: tuple[tuple[float, float], ...] = field(default=(), compare=False)
