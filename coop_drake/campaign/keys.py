"""Types of values that stand in several sections of a campaign file."""

from __future__ import annotations

from typing import Annotated, Any

from coop_drake.typed_data import EXACT, Codec, Limits

Plain = Annotated[Any, Codec(lambda value, key: value, lambda value: value)]
"""A value as it would stand in a scenario file; the scenario's own key says what is allowed."""

Seed = Annotated[int, Limits(at_least=0), EXACT]
