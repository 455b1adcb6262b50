import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.laws import funnel_bounds
from coop_drake.laws.ppc import ramped_gain
from coop_drake.systems import AxisPpc, axis_laws
from tests.support.prescribed import prescribed_acceleration
from tests.support.small_plan import small_plan
from tests.support.system_checks import evaluate, port_sizes

PLAN = small_plan(("a", "b", "c"))
AXES = [0, 2, 3]
INPUTS = {
    "object_state": [3.1, 3.2, 0.37, 0.2, -0.1, 0.4],
    "robot_state": [1.0, 2.0, 0.3, 0.11, 0.23, 0.5, 0.6, 0.7, -0.2, 0.3],
    "current_cell": [1.0, 2.0],
}


@pytest.fixture
def ppc():
    return AxisPpc(axis_laws(PLAN, AXES))


def law_by_hand(axes, position, rate, cell, time):
    law = axis_laws(PLAN, axes)[cell]
    bounds = funnel_bounds(law.funnel, time)
    gains = law.gains
    position_gain, position_gain_rate = ramped_gain(time, gains.position_gain, gains.ramp_rate)
    acceleration = prescribed_acceleration(
        np.array(position),
        np.array(rate),
        bounds,
        log_gain=gains.log_gain,
        position_gain=position_gain,
        rate_gain=gains.rate_gain,
        position_gain_rate=position_gain_rate,
        saturation=gains.saturation,
    )
    return acceleration, bounds


def test_a_clock_that_lags_shows_earlier_funnels(ppc):
    paced = AxisPpc(axis_laws(PLAN, AXES), paced=True)
    late = {**INPUTS, "clock": [0.25, 1.0, 0.0]}
    np.testing.assert_array_equal(
        evaluate(paced, late, "funnels", 2.6), evaluate(ppc, INPUTS, "funnels", 2.35)
    )


@pytest.mark.parametrize("time", [2.0, 2.6])
@pytest.mark.parametrize("cell", [0, 1, 2])
def test_all_axes_obey_the_law_since_the_entry_into_the_cell(ppc, cell, time):
    inputs = {**INPUTS, "current_cell": [cell, 2.0]}
    acceleration, bounds = law_by_hand(AXES, [0.37, 0.11, 0.23], [0.4, -0.2, 0.3], cell, time - 2.0)
    np.testing.assert_allclose(evaluate(ppc, inputs, "axis_acceleration", time), acceleration, rtol=1e-12)
    np.testing.assert_array_equal(evaluate(ppc, inputs, "funnels", time), [*bounds.lower, *bounds.upper])


def test_a_robot_without_joints_tracks_the_angle_alone():
    system = AxisPpc(axis_laws(PLAN, [0]))
    inputs = {"object_state": INPUTS["object_state"], "current_cell": INPUTS["current_cell"]}
    assert port_sizes(system)[1] == {"axis_acceleration": 1, "funnels": 2}
    acceleration, _ = law_by_hand([0], [0.37], [0.4], 1, 0.6)
    np.testing.assert_allclose(evaluate(system, inputs, "axis_acceleration", 2.6), acceleration, rtol=1e-12)


def test_a_robot_that_is_ready_enters_the_next_cell_without_a_step():
    """One step of a simulator, then the switch; a robot that is not ready remembers nothing."""
    for margin, steps in ((0.5, False), (-0.5, True)):
        system = AxisPpc(axis_laws(PLAN, AXES))
        simulator = Simulator(system)
        context = simulator.get_mutable_context()
        for name, value in {**INPUTS, "current_cell": [0, 0.0], "ready": [0.0, margin]}.items():
            system.GetInputPort(name).FixValue(context, value)
        context.SetTime(0.6)
        simulator.Initialize()
        simulator.AdvanceTo(0.6 + 1e-9)
        port = system.GetOutputPort("axis_acceleration")
        before = port.Eval(context)
        system.GetInputPort("current_cell").FixValue(context, [1, context.get_time()])
        assert (np.abs(port.Eval(context) - before).max() > 0.01) == steps


def test_from_rest_accelerations_begin_at_zero():
    start = np.array([0.2, 0.1, -0.05])
    system = AxisPpc(axis_laws(PLAN, AXES), start=start)
    inputs = {
        "object_state": [0.0, 0.0, start[0], 0.0, 0.0, 0.0],
        "robot_state": [0.0, 0.0, 0.0, *start[1:], *[0.0] * 5],
        "current_cell": [0, 0.0],
    }
    np.testing.assert_allclose(evaluate(system, inputs, "axis_acceleration", 0.0), 0.0, atol=1e-12)
    assert np.abs(evaluate(system, inputs, "axis_acceleration", 0.05)).max() > 1e-3


@pytest.mark.parametrize("output", ["axis_acceleration", "funnels"])
@pytest.mark.parametrize("index", [-1, 3])
def test_a_cell_outside_the_plan_is_refused(ppc, index, output):
    with pytest.raises(IndexError, match=f"current_cell is {index}; the plan has cells 0 to 2"):
        evaluate(ppc, {**INPUTS, "current_cell": [index, 0.0]}, output)


def test_bad_laws_are_refused():
    different = [axis_laws(PLAN, [0, 1])[0], axis_laws(PLAN, [0, 1, 2])[1]]
    for laws in ([], axis_laws(PLAN, []), different):
        with pytest.raises(ValueError, match="AxisPpc needs one law for each cell, all of the same axes"):
            AxisPpc(laws)


def test_an_axis_that_the_plan_lacks_is_refused():
    with pytest.raises(ValueError, match=r"axes \[1, 4\] are not all in 0 to 3"):
        axis_laws(PLAN, [1, 4])
