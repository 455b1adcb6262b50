"""One measured figure beside its peer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

__all__ = ["Row", "best_seconds"]


@dataclass(frozen=True)
class Row:
    """A figure and what it is compared with.

    Attributes:
        name: What was measured.
        value: The figure.
        unit: Its unit.
        peer: What stands beside it, empty if nothing does.
        peer_value: The peer's figure in the same unit.
        ratio: value / peer_value.
    """

    name: str
    value: float
    unit: str
    peer: str = ""
    peer_value: float | None = None

    @property
    def ratio(self) -> float | None:
        """The figure in units of its peer's."""
        return None if not self.peer_value else self.value / self.peer_value

    def as_dict(self) -> dict[str, object]:
        """The row as it goes into the JSON file."""
        return {
            "name": self.name,
            "value": self.value,
            "unit": self.unit,
            "peer": self.peer,
            "peer_value": self.peer_value,
            "ratio": self.ratio,
        }


def best_seconds(work: Callable[[], object], repeats: int) -> float:
    """Return the shortest of several wall times [s]; the first call warms caches and does not count."""
    work()
    times = []
    for _ in range(repeats):
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return min(times)
