"""The transports of the galleries, and how to begin each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class Case:
    """One transport.

    Attributes:
        name: Its name, also that of its files.
        about: What is special, in a sentence.
        file: The scenario's file; None for a shipped scenario, or one that ``coop-drake new`` makes.
        new: Arguments of ``coop-drake new`` besides the name; None if the scenario is there.
    """

    name: str
    about: str
    file: Path | None = None
    new: tuple[str, ...] | None = None


FLOORS = (
    Case("base", "The paper's example: a corridor with a bend, a hall and a doorway."),
    Case("warehouse", "Aisles between shelves, and a door to the dispatch room."),
    Case("tight", "The same with a corridor of 0.9 m: the arms must fold on the way."),
    Case("pillars", "Rows of pillars in a hall.", _HERE / "pillars.scenario.yaml"),
    Case(
        "inner_walls",
        "Walls inside a hall, in the shape of an L and of a U.",
        _HERE / "inner_walls.scenario.yaml",
    ),
    Case("closed", "The same with a corridor of 0.77 m, through which nobody can carry the object."),
)
"""Six floors; the team is the same."""

TEAMS = (
    Case("two_robots", "Two robots with a joint each.", new=("--robots", "2")),
    Case("three_robots", "Three robots of one model.", new=("--robots", "3")),
    Case("four_robots", "Four robots, one at every side of the object.", new=("--robots", "4")),
    Case("long_object", "A plank of 1.6 m by 0.4 m.", new=("--length", "1.6", "--width", "0.4")),
    Case("three_links", "Arms of three links with two joints.", new=("--arm", "0.3,0.3,0.3")),
    Case("three", "Three robots of different models on the floor of the paper's example."),
)
"""Six teams; all but the last in two rooms with a door between them."""
