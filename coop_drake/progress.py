"""The type of the functions that long computations call to say how far they are."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called with the name of a phase and the fraction of it that is done, 0 to 1."""
