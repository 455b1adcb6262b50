"""Behind its governor the object never has the energy to reach a wall, and every hand-over is reached."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from coop_drake.laws import ScheduledGains, energy_margin, tracking_energy
from coop_drake.laws.gains import schedule_of, scheduled_governor
from coop_drake.laws.readiness import clearance_margin
from paper.governor_run import box_clearance, run_governor, straight_field

LOWER, UPPER = np.array([0.0, -1.0]), np.array([4.0, 1.0])
fractions = st.tuples(st.floats(0.02, 0.98), st.floats(0.02, 0.98)).map(np.array)
table_2 = (50.0, 5.0, 5.0)
scheduled = [(k, np.sqrt(k), 0.8 * np.sqrt(k)) for k in (50.0, 400.0)]


@pytest.mark.slow
@settings(max_examples=20)
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
    energy = filled * energy_margin(0.0, clearance(governor), stiffness)
    direction = np.array([np.cos(heading), np.sin(heading)])
    velocity = np.sqrt(2.0 * split * energy) * direction
    position = governor + np.sqrt(2.0 * (1.0 - split) * energy / stiffness) * direction
    assume(tracking_energy(*(position - governor), *velocity, stiffness) <= energy * (1.0 + 1e-9) + 1e-12)
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


@settings(max_examples=10)
@given(st.floats(0.01, 0.4), st.floats(0.01, 0.4), st.floats(0.0, 1.0), st.sampled_from([0.0, 0.001]))
def test_every_hand_over_is_reached_and_leaves_margin(half_height, half_overlap, heading, smoothing):
    """Two corridors of any width overlap in a box: its pole is reached with margin to spare.

    The next cell has its own stiffness, and the object comes with the speed that the last one allowed.
    """
    here = box_clearance(LOWER, np.array([3.0 + half_overlap, 1.0]))
    height = np.array([0.0, half_height])
    following = box_clearance(np.array([3.0 - half_overlap, 0.0]) - height, np.array([5.0, 0.0]) + height)
    target, inradius = np.array([3.0, 0.0]), min(half_height, half_overlap)
    stiffness = scheduled_governor(schedule_of(ScheduledGains()), half_height)[0]
    start = np.array([0.3, 1.8 * heading - 0.9])
    run = run_governor(
        here,
        straight_field(target),
        position=start,
        velocity=np.zeros(2),
        governor=start,
        gains=(50.0, np.sqrt(50.0), 0.8 * np.sqrt(50.0), smoothing),
        seconds=15.0,
    )
    margins = [
        energy_margin(tracking_energy(*(p - g), *v, stiffness), following(g), stiffness)
        for p, v, g in zip(run.position, run.velocity, run.governor, strict=True)
    ]
    ready = [clearance_margin(m, stiffness, inradius) >= 0.0 for m in margins]
    first = ready.index(True)
    assert following(run.position[first]) > 0.0
    assert here(run.position[first]) > 0.0
    # Nothing takes the readiness away again while other conditions are still waited for, once at rest.
    assert ready[-1]
    assert clearance_margin(margins[-1], stiffness, inradius) == pytest.approx(0.75, abs=0.01)
