"""What is computed of every step, compiled, is what the readable laws say."""

import numpy as np

from coop_drake.laws import rotate, total_wrench
from coop_drake.simulation.step_kernels import object_wrench


def test_the_objects_wrench_is_the_sum_of_the_hands_about_its_centre_of_mass():
    generator = np.random.default_rng(2)
    wrenches, grasps, p_LLcm = (
        generator.normal(size=(4, 3)),
        generator.normal(size=(4, 2)),
        np.array([0.3, -0.1]),
    )
    offsets = rotate(0.7, grasps.T).T
    expected = total_wrench(wrenches, offsets, com_offset=rotate(0.7, p_LLcm))
    np.testing.assert_allclose(object_wrench(wrenches, grasps, p_LLcm, 0.7), expected, rtol=1e-12)
