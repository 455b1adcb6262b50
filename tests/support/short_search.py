"""Searches that end soon, for tests of what comes of a search that fails, or of how it is divided."""

from __future__ import annotations

import pytest

from coop_drake.planning import sampled_search, search


def sample_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a search sample a hundredth as much, and try two narrow passages and one path in their middle."""
    monkeypatch.setattr(search, "NARROW_ATTEMPTS", 2)
    monkeypatch.setattr(sampled_search, "CENTRED_PATHS", 1)
    monkeypatch.setattr(sampled_search, "NARROW_SAMPLES", 100)
    for name in ("FEW_SAMPLES", "MANY_SAMPLES"):
        monkeypatch.setattr(sampled_search, name, 100)
