"""What crosses between robots and their supervisor, as plain values."""

from __future__ import annotations

from typing import NamedTuple


class Report(NamedTuple):
    """A robot tells the supervisor that it is ready to leave a cell, or that it is not any more.

    Attributes:
        cell: Index of the cell.
        ready: Whether it may be left.
    """

    cell: int
    ready: bool


class Switch(NamedTuple):
    """The supervisor tells all robots that a cell was entered.

    Attributes:
        cell: Index of the cell.
        sample: Number of the sample at which it was entered.
    """

    cell: int
    sample: int


class HoldBit(NamedTuple):
    """A robot asks for a hold, or the supervisor holds the team.

    Attributes:
        held: Whether it asks, or the team is held.
        number: The number of the message, new for a new one.
    """

    held: bool
    number: int


TeamMessage = Report | Switch | HoldBit
"""A message of the team's channel."""
