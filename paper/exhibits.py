"""What the report is made of: statements of the paper beside our figures, gathered by table and figure."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

__all__ = ["Exhibit", "Picture", "Statement", "Verdict"]


class Verdict(Enum):
    """Whether our run bears the paper out; the values are what a reader sees."""

    AGREES = "agrees"
    DIFFERS = "differs"
    NO_FIGURE = "no number stated"


@dataclass(frozen=True)
class Statement:
    """One thing that the paper states, or shows without a number, and what our runs made of it.

    Attributes:
        paper: What the paper states, in our words.
        ours: What we found: one text for all runs, or one for each.
        agrees: Whether it agrees, as computed; None where the paper gives nothing to compare with.
        because: Errata and assumptions that explain the figure, by id.
    """

    paper: str
    ours: tuple[str, ...]
    agrees: bool | None
    because: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """The same in a word."""
        if self.agrees is None:
            return Verdict.NO_FIGURE
        return Verdict.AGREES if self.agrees else Verdict.DIFFERS


@dataclass(frozen=True)
class Picture:
    """A picture of the report.

    Attributes:
        file: Path below the report's folder.
        heading: What tells it from its neighbour; empty if it stands alone.
    """

    file: str
    heading: str = ""


@dataclass(frozen=True)
class Exhibit:
    """A table or a figure of the paper, reproduced.

    Attributes:
        name: As the paper numbers it.
        title: What it shows, in a few words.
        told: What the paper tells about it, in our words.
        statements: What can be compared.
        pictures: Ours.
        tables: Markdown files with the numbers, below the report's folder.
    """

    name: str
    title: str
    told: str
    statements: tuple[Statement, ...]
    pictures: tuple[Picture, ...] = ()
    tables: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """Differs if any statement does; agrees if any does and none differs."""
        verdicts = {statement.verdict for statement in self.statements}
        for verdict in (Verdict.DIFFERS, Verdict.AGREES):
            if verdict in verdicts:
                return verdict
        return Verdict.NO_FIGURE

    @property
    def differing(self) -> tuple[Statement, ...]:
        """Statements that our runs do not bear out."""
        return tuple(statement for statement in self.statements if statement.verdict is Verdict.DIFFERS)

    @property
    def because(self) -> tuple[str, ...]:
        """Errata and assumptions of all its statements, each once, in order."""
        return tuple(dict.fromkeys(key for statement in self.statements for key in statement.because))
