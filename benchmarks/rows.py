"""One measured figure beside its peer."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Row"]


@dataclass(frozen=True)
class Row:
    """A figure and what it is compared with.

    Attributes:
        name: What was measured, as ``topic/.../item/figure``.
        value: The figure; for an ``answer`` 1 if it is decided (found or proved), 0 if not.
        unit: Its unit; for an ``answer`` the answer itself.
        peer: What stands beside it, empty if nothing does.
        peer_value: The peer's figure in the same unit, None if it has none.
    """

    name: str
    value: float
    unit: str
    peer: str = ""
    peer_value: float | None = None

    @property
    def topic(self) -> str:
        """What its table is about."""
        return self.name.rsplit("/", 2)[0]

    @property
    def item(self) -> str:
        """The line of its table."""
        return self.name.rsplit("/", 2)[1]

    @property
    def figure(self) -> str:
        """The column of its table."""
        return self.name.rsplit("/", 2)[2]

    @property
    def ratio(self) -> float | None:
        """The figure in units of its peer's."""
        return None if not self.peer_value else self.value / self.peer_value

    def as_dict(self) -> dict[str, str | float | None]:
        """The row as it goes into the JSON file."""
        return {
            "name": self.name,
            "value": self.value,
            "unit": self.unit,
            "peer": self.peer,
            "peer_value": self.peer_value,
            "ratio": self.ratio,
        }
