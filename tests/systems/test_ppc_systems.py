import numpy as np
import pytest

from coop_drake.control import funnel_walls, prescribed_acceleration
from coop_drake.systems import JointPpc, OrientationPpc, axis_laws
from tests.support.small_plan import small_plan
from tests.support.system_checks import assert_every_input_is_required, evaluate, port_sizes

PLAN = small_plan(("a", "b", "c"))
ANGLE_INPUTS = {
    "object_state": [3.1, 3.2, 0.37, 0.2, -0.1, 0.4],
    "current_cell": [1.0, 2.0],
}
JOINT_INPUTS = {
    "robot_state": [1.0, 2.0, 0.3, 0.11, 0.23, 0.5, 0.6, 0.7, -0.2, 0.3],
    "current_cell": [1.0, 2.0],
}


@pytest.fixture
def orientation():
    return OrientationPpc(axis_laws(PLAN, [0]))


@pytest.fixture
def joints():
    return JointPpc(axis_laws(PLAN, [2, 3]))


def law_by_hand(axes, position, rate, cell, time):
    law = axis_laws(PLAN, axes)[cell]
    walls = funnel_walls(law.funnel, time)
    gains = law.gains
    acceleration = prescribed_acceleration(
        np.array(position),
        np.array(rate),
        walls,
        log_gain=gains.log_gain,
        position_gain=gains.position_gain,
        rate_gain=gains.rate_gain,
    )
    return acceleration, walls


def test_ports(orientation, joints):
    assert port_sizes(orientation) == (
        {"object_state": 6, "current_cell": 2},
        {"angle_acceleration": 1, "angle_funnel": 2},
    )
    assert port_sizes(joints) == (
        {"robot_state": 10, "current_cell": 2},
        {"joint_acceleration": 2, "joint_funnels": 4},
    )


@pytest.mark.parametrize("time", [2.0, 2.6])
@pytest.mark.parametrize("cell", [0, 1, 2])
def test_the_angle_obeys_the_law_since_the_entry_into_the_cell(orientation, cell, time):
    inputs = {**ANGLE_INPUTS, "current_cell": [cell, 2.0]}
    acceleration, walls = law_by_hand([0], [0.37], [0.4], cell, time - 2.0)
    np.testing.assert_allclose(
        evaluate(orientation, inputs, "angle_acceleration", time), acceleration, rtol=1e-12
    )
    np.testing.assert_array_equal(
        evaluate(orientation, inputs, "angle_funnel", time), [walls.lower[0], walls.upper[0]]
    )


@pytest.mark.parametrize("time", [2.0, 2.6])
@pytest.mark.parametrize("cell", [0, 1, 2])
def test_the_joints_obey_the_law_since_the_entry_into_the_cell(joints, cell, time):
    inputs = {**JOINT_INPUTS, "current_cell": [cell, 2.0]}
    acceleration, walls = law_by_hand([2, 3], [0.11, 0.23], [-0.2, 0.3], cell, time - 2.0)
    np.testing.assert_allclose(evaluate(joints, inputs, "joint_acceleration", time), acceleration, rtol=1e-12)
    np.testing.assert_array_equal(
        evaluate(joints, inputs, "joint_funnels", time), [*walls.lower, *walls.upper]
    )


def test_a_robot_without_joints_has_nothing_to_track():
    system = JointPpc(axis_laws(PLAN, []))
    inputs = {"robot_state": np.zeros(6), "current_cell": [0.0, 0.0]}
    assert port_sizes(system)[1] == {"joint_acceleration": 0, "joint_funnels": 0}
    assert evaluate(system, inputs, "joint_acceleration").size == 0


def test_inputs_are_required(orientation, joints):
    assert_every_input_is_required(
        orientation,
        ANGLE_INPUTS,
        {"angle_acceleration": set(ANGLE_INPUTS), "angle_funnel": {"current_cell"}},
        time=2.1,
    )
    assert_every_input_is_required(
        joints,
        JOINT_INPUTS,
        {"joint_acceleration": set(JOINT_INPUTS), "joint_funnels": {"current_cell"}},
        time=2.1,
    )


def test_bad_laws_are_refused():
    with pytest.raises(ValueError, match="OrientationPpc needs one law of one axis for each cell"):
        OrientationPpc([])
    with pytest.raises(ValueError, match="OrientationPpc needs one law of one axis for each cell"):
        OrientationPpc(axis_laws(PLAN, [0, 1]))
    with pytest.raises(ValueError, match="JointPpc needs one law of the same joints for each cell"):
        JointPpc([])
    with pytest.raises(ValueError, match="JointPpc needs one law of the same joints for each cell"):
        JointPpc([axis_laws(PLAN, [1])[0], axis_laws(PLAN, [1, 2])[1]])


def test_an_axis_that_the_plan_lacks_is_refused():
    with pytest.raises(ValueError, match=r"axes \[1, 4\] are not all in 0 to 3"):
        axis_laws(PLAN, [1, 4])
