"""The folder that a command writes its results into."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

_SIMULATION = ("maps.json", "log.npz", "transport.html", "fig[01][0-9]_*.png", "summary.png")
_FILES = {
    "plan": ("plan.json", "certificate.json", "table_1.md", *_SIMULATION),
    "simulation": _SIMULATION,
    "diagnosis": ("why.png", "why.svg"),
    "search": ("think_[0-9][0-9][0-9][0-9].png", "think.png", "think.gif", "think.html"),
}
"""Files of a plan and all that came of it, of a simulation, of a diagnosis, and of a recorded search."""


@dataclass(frozen=True)
class ResultFolder:
    """Where results go; every file in it is written under another name first and renamed when it is whole.

    Attributes:
        path: The folder; it is made when the first result is there.
    """

    path: Path

    @classmethod
    def of(cls, scenario: str, out: Path | None, below: str = "") -> ResultFolder:
        """Return the folder that was asked for, or ``out/<scenario>`` and a folder below it."""
        return cls(out if out is not None else Path("out") / scenario / below)

    @property
    def plan(self) -> Path:
        """The plan."""
        return self.path / "plan.json"

    @property
    def certificate(self) -> Path:
        """The proof that there is no plan."""
        return self.path / "certificate.json"

    @property
    def recording(self) -> Path:
        """The Meshcat recording."""
        return self.path / "transport.html"

    def forget(self, result: str) -> None:
        """Remove the files of an older result, so that the folder never mixes two: a key of ``_FILES``."""
        for pattern in _FILES[result]:
            for path in self.path.glob(pattern):
                path.unlink()
