"""What an alteration of an answer is, and small tools that several of them use."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from benchmarks.adversaries.collisions import Document

__all__ = ["Alteration", "Altered", "chosen", "copied", "having", "region_of", "step"]


@dataclass(frozen=True)
class Altered:
    """A question with an altered answer, or an altered question with its former answer.

    Attributes:
        question: The question's document.
        answer: The answer's document.
        true: Whether all statements follow from those of the sound answer.
        cells: Cells or slices that were altered, None if it may be all of them.
    """

    question: Document
    answer: Document
    true: bool = False
    cells: tuple[int, ...] | None = None


Alteration = Callable[[Document, Document, np.random.Generator], Altered | None]
"""Alters a copy of a question and of its answer; None where it does not apply."""


def copied(question: Document, answer: Document) -> tuple[Document, Document]:
    """Copies that may be altered."""
    return deepcopy(question), deepcopy(answer)


def region_of(shape: BaseGeometry) -> Document | None:
    """The document of a polygon, None if it is none."""
    if not isinstance(shape, Polygon) or shape.is_empty:
        return None
    outer, *holes = (
        shapely.get_coordinates(ring)[:-1].tolist() for ring in (shape.exterior, *shape.interiors)
    )
    return {"outer": outer, "holes": holes}


def chosen(values: Any, random: np.random.Generator) -> int:
    """Index of one of some values."""
    return int(random.integers(len(values)))


def step(random: np.random.Generator, least: float = 1e-6, most: float = 0.5) -> float:
    """A positive number whose logarithm is evenly distributed."""
    return float(np.exp(random.uniform(np.log(least), np.log(most))))


def having(answer: Document, key: str, random: np.random.Generator) -> int | None:
    """Index of a slice with entries of a kind, None if none has any."""
    places = [k for k, part in enumerate(answer["slices"]) if part.get(key)]
    return places[chosen(places, random)] if places else None
