"""The wrench shares of any team sum to the commanded wrench, wherever grasps and centre of mass are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.laws import acceleration_at, object_twist, total_wrench, wrench_share
from tests.support.robot_matrices import turned

lengths = st.floats(-1.0, 1.0)
vectors = st.tuples(lengths, lengths).map(np.array)
accelerations = st.tuples(*[st.floats(-50.0, 50.0)] * 3).map(np.array)
law = settings(max_examples=200)


@law
@given(
    st.lists(vectors, min_size=2, max_size=8),
    vectors,
    accelerations,
    st.floats(-5.0, 5.0),
    st.floats(0.1, 20.0),
    st.floats(0.01, 10.0),
    st.data(),
)
def test_shares_sum_to_the_command(offsets, com_offset, acceleration, rate, mass, inertia, data):
    weights = np.array(
        data.draw(st.lists(st.floats(0.01, 1.0), min_size=len(offsets), max_size=len(offsets)))
    )
    weights /= weights.sum()
    of_com = acceleration_at(*com_offset, *acceleration, rate)
    shares = np.array(
        [
            wrench_share(*(com_offset - offset), *of_com, acceleration[2], mass, inertia, weight)
            for offset, weight in zip(offsets, weights, strict=True)
        ]
    )
    commanded = np.array([mass * of_com[0], mass * of_com[1], inertia * acceleration[2]])
    # Every robot carries its part of the force.
    assert shares[:, :2] == pytest.approx(weights[:, None] * commanded[:2], rel=1e-12, abs=1e-12)
    total = total_wrench(shares, np.array(offsets), com_offset, 0.0)
    assert total == pytest.approx(commanded, rel=1e-12, abs=1e-10)


@law
@given(vectors, accelerations, st.floats(-3.0, 3.0))
def test_every_robot_knows_the_same_object_twist(offset_L, twist, theta):
    offset = turned(theta, offset_L)
    at_grasp = np.array([twist[0] - twist[2] * offset[1], twist[1] + twist[2] * offset[0], twist[2]])
    assert object_twist(*offset, *at_grasp) == pytest.approx(twist, rel=1e-12, abs=1e-12)
