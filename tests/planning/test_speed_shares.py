"""Limits of bases are shared so that they are kept, and by no more than they are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.planning.limits import fill


@settings(max_examples=100)
@given(st.integers(1, 4), st.integers(1, 6), st.integers(0, 10_000))
def test_shares_keep_all_bounds_and_none_could_grow(rows, count, seed):
    generator = np.random.default_rng(seed)
    levers = generator.uniform(0.2, 2.0, (rows, count)) * (generator.random((rows, count)) < 0.7)
    bounds = np.where(generator.random(rows) < 0.8, generator.uniform(0.1, 3.0, rows), np.inf)
    caps = np.where(generator.random(count) < 0.5, generator.uniform(0.1, 3.0, count), np.inf)
    shares = fill(levers, bounds, caps, generator.uniform(0.1, 2.0, count))
    finite = np.isfinite(bounds)
    free = ~((levers[finite] > 0.0).any(axis=0) | np.isfinite(caps))
    assert (np.isinf(shares) == free).all()
    known = np.where(free, 0.0, shares)
    used = levers[finite] @ known
    assert (used <= bounds[finite] * (1.0 + 1e-9)).all()
    assert (known[~free] <= caps[~free]).all()
    full = used >= bounds[finite] * (1.0 - 1e-6)
    held = (levers[finite][full] > 0.0).any(axis=0) | (known >= caps * (1.0 - 1e-6))
    assert held[~free].all()


def test_shares_are_in_proportion_to_needs_until_one_is_held():
    levers, caps = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 1.0]]), np.array([np.inf, 0.5, np.inf])
    shares = fill(levers, np.array([2.0, 6.0]), caps, np.array([1.0, 1.0, 2.0]))
    assert shares == pytest.approx([1.5, 0.5, 4.5])
