"""Reference and nominal governors, and the axes: outputs are those of the laws and keep to their regions."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake import systems
from coop_drake.laws import funnel_bounds, governed_acceleration, governor_velocity
from coop_drake.laws.governor import VELOCITY_STEP, energy_margin, tracking_energy
from coop_drake.laws.ppc import ramped_gain
from tests.support.prescribed import prescribed_acceleration
from tests.support.small_loop import governed_cells
from tests.support.small_plan import small_plan
from tests.support.system_checks import evaluate, port_sizes

CELL = {
    "object_state": [4.15, 3.2, 0.3, 0.2, -0.1, 0.4],
    "governor_position": [4.1, 3.15],
    "current_cell": [1.0, 2.0],
}


def test_a_slower_clock_slows_the_governor_alone(cells):
    command = evaluate(systems.ReferenceGovernor(cells), CELL, "governor_command")
    paced = systems.ReferenceGovernor(cells, paced=True)
    slowed = evaluate(paced, {**CELL, "clock": [0.1, 0.25, -0.5]}, "governor_command")
    np.testing.assert_array_equal(slowed, [*(0.25 * command[:2]), *command[2:]])
    assert np.linalg.norm(command[:2]) > 0.0


@pytest.mark.parametrize("index", [-1, 3])
def test_a_governor_refuses_a_cell_outside_the_plan(cells, index):
    with pytest.raises(IndexError, match=f"current_cell is {index}; the plan has cells 0 to 2"):
        evaluate(systems.ReferenceGovernor(cells), {**CELL, "current_cell": [index, 0.0]}, "energy_margin")


@pytest.fixture(scope="module")
def cells():
    return governed_cells(small_plan(("a", "b")))


@pytest.mark.parametrize("index", [0, 1, 2])
def test_outputs_are_the_law_of_the_current_cell(cells, index):
    governor, state = np.array([4.1, 3.15]), np.array([4.15, 3.2, 0.3, 0.2, -0.1, 0.4])
    inputs = {"object_state": state, "governor_position": governor, "current_cell": [index, 2.0]}
    system, cell, gains = systems.ReferenceGovernor(cells), cells[index], cells[index].gains
    rates = np.rint(state[3:5] / VELOCITY_STEP) * VELOCITY_STEP
    energy = tracking_energy(*(state[:2] - governor), *rates, gains.stiffness)
    margin = energy_margin(energy, cell.clearance(governor), gains.stiffness)
    np.testing.assert_allclose(evaluate(system, inputs, "energy_margin"), [margin], rtol=1e-15)
    velocity, acceleration = np.split(evaluate(system, inputs, "governor_command"), 2)
    pulled = governed_acceleration(state[:2], state[3:5], governor, gains.stiffness, gains.damping)
    np.testing.assert_array_equal(acceleration, pulled)
    led = governor_velocity(
        *cell.field(governor), margin, gains.stiffness, gains.governor_gain, gains.smoothing
    )
    np.testing.assert_array_equal(velocity, led)
    assert np.linalg.norm(velocity) > 0.0


PLAN = small_plan(("a", "b", "c"))

AXES = [0, 2, 3]


INPUTS = {
    "object_state": [3.1, 3.2, 0.37, 0.2, -0.1, 0.4],
    "robot_state": [1.0, 2.0, 0.3, 0.11, 0.23, 0.5, 0.6, 0.7, -0.2, 0.3],
    "current_cell": [1.0, 2.0],
}


def law_by_hand(axes, position, rate, cell, time):
    law = systems.axis_laws(PLAN, axes)[cell]
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
    paced = systems.AxisPpc(systems.axis_laws(PLAN, AXES), paced=True)
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
    system = systems.AxisPpc(systems.axis_laws(PLAN, [0]))
    inputs = {"object_state": INPUTS["object_state"], "current_cell": INPUTS["current_cell"]}
    assert port_sizes(system)[1] == {"axis_acceleration": 1, "funnels": 2}
    acceleration, _ = law_by_hand([0], [0.37], [0.4], 1, 0.6)
    np.testing.assert_allclose(evaluate(system, inputs, "axis_acceleration", 2.6), acceleration, rtol=1e-12)


def test_a_robot_that_is_ready_enters_the_next_cell_without_a_step():
    """One step of a simulator, then the switch; a robot that is not ready remembers nothing."""
    for margin, steps in ((0.5, False), (-0.5, True)):
        system = systems.AxisPpc(systems.axis_laws(PLAN, AXES))
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
    system = systems.AxisPpc(systems.axis_laws(PLAN, AXES), start=start)
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
    different = [systems.axis_laws(PLAN, [0, 1])[0], systems.axis_laws(PLAN, [0, 1, 2])[1]]
    for laws in ([], systems.axis_laws(PLAN, []), different):
        with pytest.raises(ValueError, match="AxisPpc needs one law for each cell, all of the same axes"):
            systems.AxisPpc(laws)


def test_an_axis_that_the_plan_lacks_is_refused():
    with pytest.raises(ValueError, match=r"axes \[1, 4\] are not all in 0 to 3"):
        systems.axis_laws(PLAN, [1, 4])


@pytest.fixture
def ppc():
    return systems.AxisPpc(systems.axis_laws(PLAN, AXES))
