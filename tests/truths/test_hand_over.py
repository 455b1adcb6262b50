"""Whatever corridor, slices and gains: every hand-over is certified, comes, and nothing breaks after it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.hand_over import energy_surplus, funnel_surpluses
from tests.support.point_mass import carry_out, straight_fields
from tests.support.random_plan import random_plan


@pytest.mark.slow
@settings(max_examples=12)
@given(st.integers(0, 2**32 - 1))
def test_every_hand_over_of_a_random_plan_is_safe_and_comes(seed):
    plan = random_plan(np.random.default_rng(seed), ("a::one", "b::one"))
    transport = carry_out(plan, straight_fields(plan), step=0.01)
    assert transport.stuck is None
    assert len(transport.hand_overs) == len(plan.cells)
    for index, state in enumerate(transport.hand_overs[:-1]):
        assert energy_surplus(plan, index, state[:2], state[2:4], state[4:6]) >= -1e-12
        assert funnel_surpluses(plan, index, state[6:9], state[9:]).min() >= -1e-12
    assert transport.least_energy_margin >= 0.0
    assert transport.least_cell_clearance > 0.0
    assert transport.least_funnel_gap > 0.0
