"""The parts of the report: statements of the paper beside our figures, by table and figure of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

__all__ = ["Agreement", "Exhibit", "Picture", "Statement"]


class Agreement(Enum):
    """Whether our run agrees with the paper; the values are shown to the reader."""

    AGREES = "agrees"
    DIFFERS = "differs"
    COPIED = "copied from the paper"
    NO_FIGURE = "no number stated"


@dataclass(frozen=True)
class Statement:
    """One statement of the paper, or one figure that it does not give, and the results of our runs.

    Attributes:
        paper: What the paper states, in our words.
        ours: What we found: one text for all runs, or one for each.
        agrees: Whether it agrees, as computed; None where the paper gives nothing to compare with.
        because: Errata and assumptions that explain the figure, by id.
        copied: Whether ours is a value that we took over from the paper, so that it says nothing about our
            results that both are the same.
    """

    paper: str
    ours: tuple[str, ...]
    agrees: bool | None
    because: tuple[str, ...] = ()
    copied: bool = False

    @property
    def agreement(self) -> Agreement:
        """Whether the statement agrees, for the reader."""
        if self.agrees is None:
            return Agreement.NO_FIGURE
        if not self.agrees:
            return Agreement.DIFFERS
        return Agreement.COPIED if self.copied else Agreement.AGREES


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
    """A table or a figure of the paper with what our runs give.

    Attributes:
        name: As the paper numbers it.
        title: What it shows, in a few words.
        caption: What the paper shows in it, in our words.
        statements: What can be compared.
        pictures: Ours.
        tables: Markdown files with the numbers, below the report's folder.
    """

    name: str
    title: str
    caption: str
    statements: tuple[Statement, ...]
    pictures: tuple[Picture, ...] = ()
    tables: tuple[str, ...] = ()

    @property
    def agreement(self) -> Agreement:
        """Differs if any statement differs; agrees if any agrees and none differs; else copied if any is."""
        agreements = {statement.agreement for statement in self.statements}
        for agreement in (Agreement.DIFFERS, Agreement.AGREES, Agreement.COPIED):
            if agreement in agreements:
                return agreement
        return Agreement.NO_FIGURE

    @property
    def differing(self) -> tuple[Statement, ...]:
        """Statements with which our runs do not agree."""
        return tuple(statement for statement in self.statements if statement.agreement is Agreement.DIFFERS)

    @property
    def because(self) -> tuple[str, ...]:
        """Ids of the errata and assumptions of all its statements, each once, in order."""
        return tuple(dict.fromkeys(key for statement in self.statements for key in statement.because))
