"""What an alteration of an answer is, and small tools that several of them use."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from functools import wraps
from typing import Any, NamedTuple

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from benchmarks.adversaries.collisions import Document

Random = np.random.Generator


class Change(NamedTuple):
    """What an alteration changed.

    Attributes:
        cells: Cells or slices that may have become false in themselves, None if it may be all of them.
        true: Whether all statements follow from those of the sound answer.
    """

    cells: tuple[int, ...] | None = None
    true: bool = False


ANYTHING, STATEMENTS, SOUND = Change(), Change(()), Change(true=True)
"""Any cell may have become false; only what is said of cells; nothing."""

Alteration = Callable[[Document, Document, Random], Change | None]
"""Alters a question and its answer, which are copies; None where it does not apply."""


def in_slice(key: str) -> Callable[[Callable[[Document, Document, Random, int], Change | None]], Alteration]:
    """Make an alteration of a slice of a proof, given by its index, one of any slice that has some entries.

    Args:
        key: Where the entries stand; a proof of which no slice has any is not altered.
    """

    def decorate(alter: Callable[[Document, Document, Random, int], Change | None]) -> Alteration:
        @wraps(alter)
        def altered(question: Document, answer: Document, random: Random) -> Change | None:
            places = having(answer, key)
            return alter(question, answer, random, places[chosen(places, random)]) if places else None

        return altered

    return decorate


def copied(document: Document) -> Document:
    """A copy that may be altered."""
    copy: Document = pickle.loads(pickle.dumps(document))
    return copy


def region_of(shape: BaseGeometry) -> Document | None:
    """The document of a polygon, None if it is none."""
    if not isinstance(shape, Polygon) or shape.is_empty:
        return None
    outer, *holes = (
        shapely.get_coordinates(ring)[:-1].tolist() for ring in (shape.exterior, *shape.interiors)
    )
    return {"outer": outer, "holes": holes}


def chosen(values: Any, random: Random) -> int:
    """Index of one of some values."""
    return int(random.integers(len(values)))


def step(random: Random, least: float = 1e-6, most: float = 0.5) -> float:
    """A positive number whose logarithm is evenly distributed."""
    return float(np.exp(random.uniform(np.log(least), np.log(most))))


def having(answer: Document, key: str) -> list[int]:
    """Indices of the slices that have entries of a kind."""
    return [k for k, part in enumerate(answer["slices"]) if part.get(key)]


def move(corner: list[float], random: Random, least: float = 1e-6, most: float = 0.5) -> None:
    """Move a corner (x, y) [m] by a random step in any direction."""
    turn, by = random.uniform(0.0, 2.0 * np.pi), step(random, least, most)
    corner[0] += by * float(np.cos(turn))
    corner[1] += by * float(np.sin(turn))
