import numpy as np
import pytest

from coop_drake.systems import LimitedEffort

LIMITS = np.array([5.0, 2.0, 0.5])


def given(asked):
    block = LimitedEffort(LIMITS)
    context = block.CreateDefaultContext()
    block.get_input_port().FixValue(context, asked)
    return block.get_output_port().Eval(context)


def test_a_force_is_limited_by_its_length_and_keeps_its_direction():
    np.testing.assert_allclose(given([6.0, -8.0, 0.0, 0.0]), [3.0, -4.0, 0.0, 0.0], rtol=1e-14)
    np.testing.assert_array_equal(given([2.0, -np.inf, 0.0, np.inf]), [0.0, -5.0, 0.0, 0.5])
    np.testing.assert_array_equal(given([4.0, 3.0, 0.0, 0.0]), [4.0, 3.0, 0.0, 0.0])


def test_torques_and_joints_are_limited_one_by_one():
    np.testing.assert_array_equal(given([0.0, 1.0, -3.0, 0.7]), [0.0, 1.0, -2.0, 0.5])


def test_a_limit_of_zero_is_refused():
    with pytest.raises(ValueError, match="needs positive limits"):
        LimitedEffort(np.array([1.0, 0.0]))
