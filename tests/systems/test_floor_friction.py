import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coop_drake.laws.team_dynamics import CREEP_SPEED, base_friction
from coop_drake.systems import FloorFriction
from tests.support.system_checks import evaluate, port_sizes

SPEEDS = st.floats(-3.0, 3.0)


@given(SPEEDS, SPEEDS, st.floats(0.0, 100.0), st.floats(0.0, 100.0))
def test_friction_opposes_motion_and_is_no_stronger_than_stated(vx, vy, coulomb, viscous):
    force, speed = np.array(base_friction(vx, vy, coulomb, viscous)), np.hypot(vx, vy)
    assert force @ [vx, vy] <= 0.0
    assert force[0] * vy == pytest.approx(force[1] * vx, abs=1e-9)
    assert np.hypot(*force) <= (coulomb + viscous * speed) * (1.0 + 1e-12)
    if speed > 10.0 * CREEP_SPEED:
        assert np.hypot(*force) >= 0.99 * (coulomb + viscous * speed)


def test_every_base_has_its_own():
    block = FloorFriction([1, 0], 30.0, 2.0)
    assert port_sizes(block) == ({"robot_0_state": 8, "robot_1_state": 6}, {"friction_wrenches": 6})
    inputs = {
        "robot_0_state": [1.0, 2.0, 3.0, 4.0, 0.3, 0.4, 5.0, 6.0],
        "robot_1_state": [1.0, 2.0, 3.0, 0.0, -1.0, 4.0],
    }
    expected = [*base_friction(0.3, 0.4, 30.0, 2.0), 0.0, *base_friction(0.0, -1.0, 30.0, 2.0), 0.0]
    np.testing.assert_array_equal(evaluate(block, inputs, "friction_wrenches"), expected)


@pytest.mark.parametrize("friction", [(-1.0, 0.0), (0.0, -1.0)])
def test_friction_that_would_drive_is_refused(friction):
    with pytest.raises(ValueError, match="no negative friction"):
        FloorFriction([1], *friction)
