"""E21: the sign of the cross term in (21) and (31)."""

import numpy as np
import pytest

from coop_drake.laws import total_wrench, wrench_share
from paper import printed

FORCE, TORQUE = np.array([3.0, 4.0]), 0.7
NO_COM_OFFSET = np.zeros(2)
OPPOSITE = np.array([[0.4, 0.0], [-0.4, 0.0]])
ONE_SIDED = np.array([[0.4, 0.0], [0.0, 0.25]])
THREE = np.array([[0.4, 0.0], [-0.4, 0.0], [0.0, 0.25]])


def total_as_printed(offsets):
    shares = [printed.wrench_share(FORCE, TORQUE, -offset, robots=len(offsets)) for offset in offsets]
    return total_wrench(np.array(shares), offsets, NO_COM_OFFSET, 0.0)


def total_as_corrected(offsets):
    shares = [wrench_share(*-offset, *FORCE, TORQUE, 1.0, 1.0, 1.0 / len(offsets)) for offset in offsets]
    return total_wrench(np.array(shares), offsets, NO_COM_OFFSET, 0.0)


@pytest.mark.parametrize("offsets", [OPPOSITE, ONE_SIDED, THREE])
def test_e21_with_a_plus_the_shares_sum_to_the_command(offsets):
    assert total_as_corrected(offsets) == pytest.approx([*FORCE, TORQUE], abs=1e-14)


@pytest.mark.parametrize("offsets", [ONE_SIDED, THREE])
def test_e21_with_a_minus_asymmetric_grasps_turn_the_object(offsets):
    """At 5 N the torque is wrong by 2 r^perp . F, averaged over the grasps."""
    error = total_as_printed(offsets)[2] - TORQUE
    mean = offsets.mean(axis=0)
    assert error == pytest.approx(2.0 * (mean[0] * FORCE[1] - mean[1] * FORCE[0]))
    assert abs(error) > 0.4


def test_e21_opposite_grasps_hide_the_sign():
    assert total_as_printed(OPPOSITE) == pytest.approx([*FORCE, TORQUE], abs=1e-14)
