"""Reference and nominal governors, and the axes: outputs are those of the laws and keep to their regions."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from coop_drake import systems
from coop_drake.answers.budget import AxisTracking
from coop_drake.diagram.robot_controller import robot_knowledge
from coop_drake.laws import funnel_bounds, governed_acceleration, governor_velocity
from coop_drake.laws.governor import VELOCITY_STEP, energy_margin, tracking_energy
from coop_drake.laws.nominal import carry_axes, nominal_flow
from coop_drake.laws.ppc import ramped_gain
from coop_drake.plant import build_team_plant
from coop_drake.simulation import build_maps
from coop_drake.systems.kernels import nominal_margins, step_nominal
from tests.support.prescribed import prescribed_acceleration
from tests.support.small_loop import governed_cells
from tests.support.small_plan import small_plan
from tests.support.system_checks import context_with, evaluate, port_sizes
from tests.support.tubes import BUDGET, tubed_problem

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


@cache
def known():
    """Cells and nominal motion as robot 0 knows them, with measurements that are two periods old."""
    scenario, plan = tubed_problem()
    team = build_team_plant(scenario, DiagramBuilder())
    robot = robot_knowledge(scenario, plan, build_maps(plan), team)[0]
    return robot.cells, replace(robot.motion, measurement_periods=2)


def at_place(x=3.0, y=3.0):
    return {"object_state": [x, y, 0.2, 0.0, 0.0, 0.0], "current_cell": [0.0, 0.0]}


def stepped(system, context, steps):
    """States after every step, shape (steps, size)."""
    states = []
    for _ in range(steps):
        context.SetDiscreteState(system.EvalUniquePeriodicDiscreteUpdate(context))
        states.append(context.get_discrete_state_vector().CopyToVector())
    return np.array(states)


def test_the_reference_moves_alike_whatever_is_measured():
    system = systems.NominalGovernor(*known())
    runs = [
        stepped(system, context_with(system, at_place(*place)), 200) for place in ((3.0, 3.0), (9.0, -4.0))
    ]
    np.testing.assert_array_equal(*runs)
    assert np.linalg.norm(runs[0][-1, 4:6] - runs[0][0, 4:6]) > 0.1


def test_the_nominal_motion_is_the_flow_behind_the_reference():
    (cells, motion), system = known(), systems.NominalGovernor(*known())
    states, gains = stepped(system, context_with(system, at_place()), 100), cells[0].gains
    flow = nominal_flow(gains.stiffness, gains.damping, motion.period)
    for before, after in pairwise(states):
        for i in range(2):
            off, rate = flow @ (before[i] - before[4 + i], before[2 + i])
            assert after[i] == pytest.approx(before[4 + i] + off, abs=1e-14)
            assert after[2 + i] == pytest.approx(rate, abs=1e-14)


def test_the_nominal_motion_never_leaves_its_region_and_the_reference_keeps_its_speed():
    (cells, motion), system = known(), systems.NominalGovernor(*known())
    states = stepped(system, context_with(system, at_place()), 600)
    rooms = [
        nominal_margins(cells[0].clearance.edges, cells[0].gains.stiffness, state[:4], state[4:6])[1]
        for state in states
    ]
    assert min(rooms) >= 0.0
    steps = np.hypot(*np.diff(states[:, 4:6], axis=0).T)
    assert 0.5 * motion.tube.speed < steps.max() / motion.period <= motion.tube.speed * (1.0 + 1e-9)
    assert np.linalg.norm(states[-1, :2] - motion.targets[0]) < 1e-3


@pytest.mark.parametrize("room", [1e-7, 1e-6, 1e-5, 1e-4])
def test_where_little_room_is_left_the_reference_uses_half_of_it_and_follows_the_field(room):
    (cells, motion), following = known(), np.empty(6)
    cell, governor = cells[0], motion.start
    speed = np.sqrt(cell.gains.stiffness) * (cell.clearance(governor) - room)
    flow = nominal_flow(cell.gains.stiffness, cell.gains.damping, motion.period)
    state = np.array([*governor, speed, 0.0, *governor])
    step_nominal(*cell.known, flow, motion.period, 10.0, 1.0, state, following)
    step, direction = following[4:] - governor, cell.field(governor)
    assert np.linalg.norm(step) == pytest.approx(0.5 * room, rel=1e-6)
    assert step @ direction == pytest.approx(np.linalg.norm(step) * np.linalg.norm(direction))


def test_the_command_compares_measurements_with_the_nominal_state_of_their_time():
    (cells, motion), system = known(), systems.NominalGovernor(*known())
    context = context_with(system, at_place())
    states, gains = stepped(system, context, 40), motion.tracking_row(cells[0])
    command = system.GetOutputPort("governor_command").Eval(context)
    now, then = states[-1], states[-3]
    for i, place in enumerate((3.0, 3.0)):
        expected = governed_acceleration(now[i], now[2 + i], now[4 + i], *gains[:2])
        expected += governed_acceleration(place - then[i], -then[2 + i], 0.0, *gains[2:])
        assert command[2 + i] == pytest.approx(expected, rel=1e-12)
        assert command[i] == pytest.approx((now[4 + i] - states[-2][4 + i]) / motion.period)


def test_what_it_shows():
    (cells, motion), system = known(), systems.NominalGovernor(*known())
    context = context_with(system, at_place())
    state, gains = stepped(system, context, 30)[-1], cells[0].gains
    shown = system.GetOutputPort("nominal").Eval(context)
    np.testing.assert_array_equal(shown[:4], state[:4])
    energy = tracking_energy(*(state[:2] - state[4:6]), *state[2:4], gains.stiffness)
    margin = energy_margin(energy, cells[0].clearance(state[4:6]), gains.stiffness)
    assert shown[4] == system.GetOutputPort("energy_margin").Eval(context)[0] == pytest.approx(margin)
    assert 0.0 < shown[5] <= motion.report_periods * motion.period * motion.tube.speed
    np.testing.assert_array_equal(system.GetOutputPort("governor_position").Eval(context), state[4:6])


def test_at_rest_the_reference_waits_and_with_half_the_pace_it_is_half_as_fast():
    system = systems.NominalGovernor(*known(), paced=True)
    distances = []
    for pace in (0.0, 0.5, 1.0):
        context = context_with(system, {**at_place(), "clock": [0.0, pace, 0.0]})
        state = stepped(system, context, 1)[-1]
        distances.append(np.linalg.norm(state[4:6] - state[6:8]))
    assert distances[0] == 0.0
    assert distances[1] <= distances[2]
    assert distances[1] > 0.0


def test_refusals():
    cells, motion = known()
    with pytest.raises(ValueError, match="one target for each cell, not 3 for 0"):
        systems.NominalGovernor([], motion)
    other = replace(cells[1], gains=replace(cells[1].gains, stiffness=70.0))
    with pytest.raises(ValueError, match="the same K in all cells"):
        systems.NominalGovernor([cells[0], other, cells[2]], motion)
    with pytest.raises(RuntimeError, match="object_state"):
        evaluate(systems.NominalGovernor(cells, motion), {"current_cell": [0.0, 0.0]}, "governor_command")
    assert BUDGET.period == motion.period


START = np.array([0.4, -0.2, 0.7])
"""The object's angle and two joints."""


MOUNTING = np.array([0.3, -1.0, 0.0])
"""The base's yaw at zero; the first joint turns it backwards, the second one slides."""


def block(periods=2, axes=3):
    return systems.NominalAxes(
        systems.AxisMotion(AxisTracking(500.0, 38.0), START[:axes], 0.005, 0.005, periods, MOUNTING[:axes])
    )


def measured(angle=0.41, joints=(-0.21, 0.69), law=(1.0, -2.0, 3.0)):
    return {
        "object_state": [3.0, 4.0, angle, 0.1, 0.2, 0.3],
        "robot_state": [1.0, 2.0, 0.5, *joints, 0.1, 0.2, 0.3, 0.04, -0.05],
        "axis_acceleration": list(law),
    }


def context_after(system, context, steps):
    for _ in range(steps):
        context.SetDiscreteState(system.EvalUniquePeriodicDiscreteUpdate(context))
    return context


def test_the_motion_follows_the_law_alone():
    system, states = block(), []
    for angle in (0.41, -3.0):
        context = context_after(system, context_with(system, measured(angle)), 50)
        states.append(context.get_discrete_state_vector().CopyToVector())
    np.testing.assert_array_equal(*states)
    state = np.array([START, np.zeros(3), np.zeros(3)])
    for _ in range(50):
        following = np.empty((3, 3))
        carry_axes(state, np.array([1.0, -2.0, 3.0]), 0.005, 0.005, following)
        state = following
    np.testing.assert_array_equal(states[0][:9].reshape(3, 3), state)


@pytest.mark.parametrize(
    ("names", "ahead"),
    [(("nominal_object", "nominal_robot"), 0.0), (("object_ahead", "robot_ahead"), 0.0075)],
)
def test_angles_and_rates_are_nominal_and_the_rest_as_measured(names, ahead):
    system, state = block(), np.empty((3, 3))
    context = context_after(system, context_with(system, measured()), 3)
    now = context.get_discrete_state_vector().CopyToVector()[:9].reshape(3, 3)
    carry_axes(now, np.array([1.0, -2.0, 3.0]), ahead, 0.005, state)
    shown, robot = (system.GetOutputPort(name).Eval(context) for name in names)
    np.testing.assert_allclose(shown, [3.0, 4.0, state[0, 0], 0.1, 0.2, state[1, 0]], rtol=1e-14)
    yaw, rate = state[0, 0] + 0.3 - state[0, 1], state[1, 0] - state[1, 1]
    expected = [1.0, 2.0, yaw, *state[0, 1:], 0.1, 0.2, rate, *state[1, 1:]]
    np.testing.assert_allclose(robot, expected, rtol=1e-14)


@pytest.mark.parametrize("periods", [0, 2])
def test_measurements_are_compared_with_the_motion_of_their_time(periods):
    system = block(periods)
    context = context_with(system, measured())
    past = [context.get_discrete_state_vector().CopyToVector()[:6].reshape(2, 3)]
    for _ in range(7):
        context_after(system, context, 1)
        past.append(context.get_discrete_state_vector().CopyToVector()[:6].reshape(2, 3))
    expected, seen = past[-1 - periods], ((0.41, 0.3), (-0.21, 0.04), (0.69, -0.05))
    pulled = [
        law + governed_acceleration(x - expected[0, i], v - expected[1, i], 0.0, 500.0, 38.0)
        for i, (law, (x, v)) in enumerate(zip((1.0, -2.0, 3.0), seen, strict=True))
    ]
    np.testing.assert_allclose(system.GetOutputPort("pulled_axes").Eval(context), pulled, rtol=1e-14)


def test_a_robot_without_joints_needs_no_state_of_its_own():
    system = block(axes=1)
    inputs = measured(law=(1.0,))
    del inputs["robot_state"]
    assert evaluate(system, inputs, "pulled_axes").shape == (1,)
