"""The decorator of ``jit`` under the name that files import it by until they move."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeVar

from coop_drake.jit import compiled

__all__ = ["compiled", "prepared"]

R = TypeVar("R")


def prepared(function: Callable[..., R], given: Sequence[object], *_: object) -> Callable[..., R]:
    """Return a compiled function with its first arguments given."""
    return partial(function, *given)
