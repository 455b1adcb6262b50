"""The folder that a command leaves behind."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

__all__ = ["ResultFolder"]

_AFTER_PLANNING = ("plan.json", "certificate.json", "table_1.md")
_AFTER_DIAGNOSING = ("why.png", "why.svg")
_AFTER_SIMULATING = ("maps.json", "log.npz", "transport.html", "fig[01][0-9]_*.png", "summary.png")


@dataclass(frozen=True)
class ResultFolder:
    """Where results go; every file in it is written under another name first and renamed when whole.

    Attributes:
        path: The folder; it is made when the first result is there.
    """

    path: Path

    @classmethod
    def of(cls, scenario: str, out: Path | None) -> ResultFolder:
        """Return the folder that was asked for, or the usual one of a scenario."""
        return cls(out if out is not None else Path("out") / scenario)

    @property
    def plan(self) -> Path:
        """The plan."""
        return self.path / "plan.json"

    @property
    def certificate(self) -> Path:
        """The proof that there is no plan."""
        return self.path / "certificate.json"

    @property
    def table(self) -> Path:
        """The cells' intervals, the paper's Table 1."""
        return self.path / "table_1.md"

    @property
    def maps(self) -> Path:
        """The certificates of the cells' maps."""
        return self.path / "maps.json"

    @property
    def log(self) -> Path:
        """The simulation log."""
        return self.path / "log.npz"

    @property
    def recording(self) -> Path:
        """The Meshcat recording."""
        return self.path / "transport.html"

    @property
    def diagram(self) -> Path:
        """How the closed loop is wired."""
        return self.path / "diagram.svg"

    @property
    def diagnosis(self) -> tuple[Path, Path]:
        """The picture that says why there is no plan, for screens and for print."""
        return self.path / "why.png", self.path / "why.svg"

    def make(self) -> None:
        """Make the folder."""
        self.path.mkdir(parents=True, exist_ok=True)

    def forget_plan(self) -> None:
        """Remove an older plan and all that came of it, so that the folder never mixes two runs."""
        self._remove(_AFTER_PLANNING)
        self.forget_simulation()

    def forget_simulation(self) -> None:
        """Remove an older simulation's log, certificates of maps, recording and figures."""
        self._remove(_AFTER_SIMULATING)

    def forget_diagnosis(self) -> None:
        """Remove an older diagnosis."""
        self._remove(_AFTER_DIAGNOSING)

    def _remove(self, patterns: tuple[str, ...]) -> None:
        for pattern in patterns:
            for path in self.path.glob(pattern):
                path.unlink()
