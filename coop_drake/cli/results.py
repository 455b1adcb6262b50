"""The folder that a command writes its results into."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

_PLANNING = ("plan.json", "certificate.json", "table_1.md")
_DIAGNOSIS = ("why.png", "why.svg")
_SIMULATION = ("maps.json", "log.npz", "transport.html", "fig[01][0-9]_*.png", "summary.png")


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

    def make(self) -> None:
        """Make the folder."""
        self.path.mkdir(parents=True, exist_ok=True)

    def forget_plan(self) -> None:
        """Remove an older plan and all that came of it, so that the folder never mixes two runs."""
        self._remove(_PLANNING)
        self.forget_simulation()

    def forget_simulation(self) -> None:
        """Remove an older simulation's log, certificates of maps, recording and figures."""
        self._remove(_SIMULATION)

    def forget_diagnosis(self) -> None:
        """Remove an older diagnosis."""
        self._remove(_DIAGNOSIS)

    def _remove(self, patterns: tuple[str, ...]) -> None:
        for pattern in patterns:
            for path in self.path.glob(pattern):
                path.unlink()
