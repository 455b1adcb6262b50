"""Behind its governor the object never has the energy to reach a wall, and it ends at the target."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from coop_drake.control import energy_margin, tracking_energy
from tests.support.governor_run import box_clearance, run_governor, straight_field

LOWER, UPPER = np.array([0.0, -1.0]), np.array([4.0, 1.0])
fractions = st.tuples(st.floats(0.02, 0.98), st.floats(0.02, 0.98)).map(np.array)
table_2 = (50.0, 5.0, 5.0)
scheduled = [(k, np.sqrt(k), 0.8 * np.sqrt(k)) for k in (50.0, 400.0)]


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    st.sampled_from([table_2, *scheduled]),
    st.sampled_from([0.0, 0.001]),
    fractions,
    fractions,
    st.floats(-np.pi, np.pi),
    st.sampled_from([0.0, 0.1, 0.5, 0.95]),
    st.sampled_from([0.0, 0.3, 1.0]),
)
def test_the_margin_never_becomes_negative(gains, smoothing, start, target, heading, filled, split):
    """From any start whose energy fills a part of what the clearance allows, as speed or as distance."""
    governor, target = LOWER + start * (UPPER - LOWER), LOWER + target * (UPPER - LOWER)
    clearance = box_clearance(LOWER, UPPER)
    stiffness = gains[0]
    energy = filled * energy_margin(0.0, clearance(governor), stiffness=stiffness)
    direction = np.array([np.cos(heading), np.sin(heading)])
    velocity = np.sqrt(2.0 * split * energy) * direction
    position = governor + np.sqrt(2.0 * (1.0 - split) * energy / stiffness) * direction
    assume(
        tracking_energy(position, velocity, governor, stiffness=stiffness) <= energy * (1.0 + 1e-9) + 1e-12
    )
    run = run_governor(
        clearance,
        straight_field(target),
        position=position,
        velocity=velocity,
        governor=governor,
        gains=(*gains, smoothing),
        seconds=12.0,
    )
    assert run.margin.min() >= -1e-9
    assert min(clearance(p) for p in run.position) >= 0.0
    assert run.position[-1] == pytest.approx(target, abs=0.01)
