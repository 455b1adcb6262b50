"""The one decorator that turns a numerical function into machine code, cached on disk beside the source."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

__all__ = ["compiled"]

F = TypeVar("F", bound=Callable[..., object])

# Sums may be reassociated so that they use vector units; NaN and infinity keep their meaning.
_FAST = {"contract", "reassoc"}


def compiled(function: F) -> F:
    """Compile at the first call; single-threaded, division by zero gives infinity as in numpy."""
    return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)(function))
