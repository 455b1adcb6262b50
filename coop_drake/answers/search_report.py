"""What the search did to find its answer: slices, margins, time."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ["SearchReport"]


@dataclass(frozen=True)
class SearchReport:
    """What the search did.

    Attributes:
        slices: Compound slices swept, all attempts together: those of explorations and the boxes that were
            tried along sampled paths.
        free_cells: Under-cells found in the last attempt.
        mixed_cells: Undecided over-cells left in the last attempt.
        margins: Margins tried, in order, each with its verdict.
        resolution: For an undecided answer: the widest slice left on the channel, as a fraction of its axis.
        first_plan_cpu_seconds: Processor time until a channel was certified, whatever its margin, None if
            none was [s]. It decides nothing and makes no difference between reports.
    """

    slices: int
    free_cells: int
    mixed_cells: int
    margins: tuple[tuple[float, str], ...]
    resolution: float | None = None
    first_plan_cpu_seconds: float | None = field(default=None, compare=False)
