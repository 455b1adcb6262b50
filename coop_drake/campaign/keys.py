"""Types of values that stand in several sections of a campaign file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from coop_drake.typed_data import EXACT, DataError, Limits

Plain = Any
"""A value as it would stand in a scenario file; the scenario's own key says what is allowed."""

LARGEST_SEED = 2**32 - 1
"""Largest seed: numpy and optimisers take no larger one everywhere, and tables of records hold it."""

Seed = Annotated[int, Limits(at_least=0, below=LARGEST_SEED + 1), EXACT]
"""From what numbers are drawn."""

SEED_KEY = "deployment.seed"
"""The key of the seed of noise and losses, which every run has of its own."""


def check_keys(said: Mapping[str, Any], **varied: Mapping[str, Any]) -> None:
    """Refuse a seed that would be ignored, and values that would overwrite others inside them.

    What ``set`` says of a whole section may be varied in parts.

    Args:
        said: What ``set`` says, by dotted keys.
        varied: What differs from run to run, by dotted keys, each by the name of its section.

    Raises:
        DataError: With the key and what is allowed there.
    """
    top, _, name = SEED_KEY.partition(".")
    whole = said.get(top)
    if SEED_KEY in said or (isinstance(whole, dict) and name in whole):
        allowed = "no seed: every run has one of its own, which grid may state"
        raise DataError(f"set.{SEED_KEY}", said.get(SEED_KEY, whole), allowed)
    sections = {"set": said, **varied}
    places = [(section, key) for section, keys in sections.items() for key in keys]
    for section, outer in places:
        for other, inner in places:
            inside = inner.startswith((f"{outer}.", f"{outer}["))
            if inside and (section != "set" or other == "set"):
                allowed = f"no key around {other}.{inner}: each would overwrite the other"
                raise DataError(f"{section}.{outer}", sections[section][outer], allowed)
