"""What a deployment puts round the controllers, and that it is nothing where nothing is switched on."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.diagram import build_closed_loop
from coop_drake.scenario import ActuatorLimits, Deployment, Measurements, Messages, StartOffset, Wave, Waves
from tests.support.small_loop import small_maps, small_problem
from tests.support.system_checks import port_sizes

NOISE = Measurements(position_noise=0.01, angle_noise=0.02, rate_noise=0.03)


def loop_of(**deployment):
    scenario, plan = small_problem("base")
    return build_closed_loop(replace(scenario, deployment=Deployment(**deployment)), plan, small_maps())


def parts(diagram):
    return {system.get_name() for system in diagram.GetSystems()}


def test_an_ideal_team_has_nothing_round_its_controllers():
    loop = loop_of(seed=3)
    assert loop.deployed == ()
    assert loop.bare_controllers == loop.controllers


@pytest.mark.slow
@pytest.mark.parametrize(
    ("deployment", "more"),
    [
        ({"mass_error": 0.1}, set()),
        ({"actuators": ActuatorLimits(base_force=50.0)}, set()),
        ({"control_rate": 200.0}, {"effort_hold", "radio"}),
        (
            {"control_rate": 200.0, "measurements": NOISE},
            {"effort_hold", "radio", "object_pose_measured", "robot_state_measured"},
        ),
        (
            {"control_rate": 200.0, "measurements": Measurements(waves=Waves(joints=Wave(0.001)))},
            {"effort_hold", "radio", "robot_state_measured"},
        ),
        (
            {"control_rate": 200.0, "measurements": Measurements(delay=0.01)},
            {"effort_hold", "radio", "object_pose_delay", "robot_state_delay"},
        ),
        (
            {"actuators": ActuatorLimits(lag=0.01)},
            {"effort_in_kilonewtons", "actuator_lag", "lagged_effort"},
        ),
        (
            {"control_rate": 200.0, "actuators": ActuatorLimits(lag=0.01)},
            {"effort_hold", "radio", "actuator_lag"},
        ),
    ],
)
def test_only_what_is_switched_on_is_there_beside_a_limit(deployment, more):
    loop = loop_of(**deployment)
    for deployed, controller in zip(loop.deployed, loop.controllers, strict=True):
        assert deployed.diagram is controller
        assert parts(controller) == {"controller", "actuator_limits"} | more
        assert port_sizes(controller) == port_sizes(deployed.controller)


def test_a_sampled_team_keeps_its_governors_between_samples():
    loop = loop_of(control_rate=200.0)
    root = loop.create_context()
    assert root.num_continuous_states() == 2 * (3 + len(loop.team.joints))
    for law in loop.bare_controllers:
        governor = law.GetOutputPort("governor_position").Eval(law.GetMyContextFromRoot(root))
        np.testing.assert_array_equal(governor, loop.plan.start[:2])


def test_a_team_may_stand_off_the_start_and_its_controllers_do_not_know():
    offset = StartOffset(0.01, -0.02, 0.03, (0.04, -0.05))
    loop, there = loop_of(start_offset=offset), loop_of()
    contexts = [one.create_context() for one in (loop, there)]
    states = [
        one.team.plant.GetPositions(one.team.plant.GetMyContextFromRoot(context))[one.team.position_index]
        for one, context in zip((loop, there), contexts, strict=True)
    ]
    assert states[0] - states[1] == pytest.approx([0.01, -0.02, 0.03, 0.04, -0.05])
    assert states[1] == pytest.approx(there.plan.start)
    assert loop.plan.start == pytest.approx(there.plan.start)


def test_before_the_start_everything_stood_still():
    loop = loop_of(control_rate=200.0, measurements=Measurements(delay=0.02))
    root = loop.create_context()
    for law in loop.bare_controllers:
        state = law.GetOutputPort("object_state").Eval(law.GetMyContextFromRoot(root))
        np.testing.assert_allclose(state, [*loop.plan.start[:3], 0.0, 0.0, 0.0], atol=1e-12)


def test_every_robot_has_noise_of_its_own_and_a_seed_decides_it():
    def measured(seed):
        loop = loop_of(control_rate=200.0, measurements=NOISE, seed=seed)
        simulator = Simulator(loop.diagram, loop.create_context())
        simulator.AdvanceTo(0.05)
        root = simulator.get_context()
        return [
            law.GetInputPort("object_pose").Eval(law.GetMyContextFromRoot(root)).tolist()
            for law in loop.bare_controllers
        ]

    first = measured(1)
    assert measured(1) == first
    assert measured(2) != first
    assert first[0] != first[1]


def test_positions_angles_and_rates_have_deviations_of_their_own():
    controller = loop_of(control_rate=200.0, measurements=NOISE).controllers[0]
    rates = [0.03] * 4
    for name, expected in (
        ("object_pose", [0.01, 0.01, 0.02]),
        ("robot_state", [0.01, 0.01, 0.02, 0.02, *rates]),
    ):
        noise = controller.GetSubsystemByName(f"{name}_measured")
        context, found = noise.CreateDefaultContext(), []
        noise.get_input_port().FixValue(context, np.zeros(len(expected)))
        for period in range(400):
            context.SetTime(period / 200.0)
            found.append(noise.get_output_port().Eval(context))
        np.testing.assert_allclose(np.std(found, axis=0), expected, rtol=0.15)


def test_actuators_give_no_more_than_their_limits():
    loop = loop_of(actuators=ActuatorLimits(base_force=0.5, base_torque=0.25, joint_effort=0.125))
    simulator = Simulator(loop.diagram, loop.create_context())
    simulator.AdvanceTo(0.2)
    for controller, law in zip(loop.controllers, loop.bare_controllers, strict=True):
        given, wanted = (
            part.GetOutputPort("robot_effort").Eval(part.GetMyContextFromRoot(simulator.get_context()))
            for part in (controller, law)
        )
        assert np.hypot(*given[:2]) <= 0.5 * (1.0 + 1e-12)
        np.testing.assert_allclose(given[:2], wanted[:2] * min(1.0, 0.5 / np.hypot(*wanted[:2])), rtol=1e-12)
        np.testing.assert_array_equal(given[2:], np.clip(wanted[2:], [-0.25, -0.125], [0.25, 0.125]))
        assert np.any(given != wanted)


def test_where_no_limit_is_given_the_limit_lets_every_effort_pass_but_those_of_a_lost_run():
    loop = loop_of(mass_error=0.1)
    limit = loop.controllers[0].GetSubsystemByName("actuator_limits")
    context = limit.CreateDefaultContext()
    for asked, given in ((5e4, 5e4), (1e9, 1e5), (-np.inf, -1e5)):
        limit.get_input_port().FixValue(context, np.full(4, asked))
        along = given if asked == given else given / np.sqrt(2.0)  # the force is limited by its length
        expected = [along, along, given, given]
        np.testing.assert_allclose(limit.get_output_port().Eval(context), expected, rtol=1e-14)


def test_actuators_follow_their_commands_with_a_lag():
    """In continuous time: the rate of what is given is what is still missing, over the time constant."""
    loop, lag = loop_of(actuators=ActuatorLimits(lag=0.02)), 0.02
    simulator = Simulator(loop.diagram, loop.create_context())
    given = []
    for time in (0.0, 0.1, 0.1 + 1e-5):
        simulator.AdvanceTo(time)
        root = simulator.get_context()
        given.append(
            [
                part.GetOutputPort("robot_effort").Eval(part.GetMyContextFromRoot(root))
                for part in loop.controllers
            ]
        )
        wanted = [
            law.GetOutputPort("robot_effort").Eval(law.GetMyContextFromRoot(root))
            for law in loop.bare_controllers
        ]
    given = np.array(given)
    np.testing.assert_array_equal(given[0], 0.0)
    expected = (np.array(wanted) - given[2]) / lag
    np.testing.assert_allclose((given[2] - given[1]) / 1e-5, expected, rtol=1e-2, atol=0.1)
    assert np.abs(expected).max() > 10.0


def test_a_controller_gets_the_waves_of_what_it_measures():
    waves = Waves(*[Wave(0.001 * (1 + i), period=0.02, phase=0.5) for i in range(8)])
    loop = loop_of(control_rate=100.0, measurements=Measurements(waves=waves))
    root, expected = loop.create_context(), loop_of(control_rate=100.0)
    exact = expected.create_context()
    for port, errors in (
        ("object_pose", [1, 2, 3]),
        ("robot_state", [0, 0, 0, 4, 5, 6, 7, 8]),
    ):
        read = [
            law.GetInputPort(port).Eval(law.GetMyContextFromRoot(context))
            for law, context in ((loop.bare_controllers[0], root), (expected.bare_controllers[0], exact))
        ]
        np.testing.assert_allclose(read[0] - read[1], -0.001 * np.array(errors), atol=1e-12)


@pytest.mark.parametrize("periods", [1, 2, 4])
def test_a_controller_gets_measurements_of_the_age_that_is_stated(periods):
    """At the instant at which it computes its effort, which is held from then on."""
    loop = loop_of(control_rate=100.0, measurements=Measurements(delay=0.01 * periods))
    simulator, true, known = Simulator(loop.diagram, loop.create_context()), [], []
    law = loop.bare_controllers[0]
    for k in range(12):
        simulator.AdvanceTo(0.01 * k)  # the updates of this instant are still to come
        root = simulator.get_context()
        true.append(
            loop.station.diagram.GetOutputPort("object_pose").Eval(
                loop.station.diagram.GetMyContextFromRoot(root)
            )
        )
        known.append(law.GetInputPort("object_pose").Eval(law.GetMyContextFromRoot(root)))
    np.testing.assert_array_equal(known[periods:], true[:-periods])
    assert np.abs(np.subtract(true[-1], true[-2])).max() > 1e-9


def test_robots_that_overestimate_masses_push_harder():
    efforts = []
    for error in (0.0, 0.5):
        loop = loop_of(mass_error=error)
        root = loop.create_context()
        root.SetTime(0.3)  # walls and k1 begin at rest
        efforts.append(
            [
                law.GetOutputPort("robot_effort").Eval(law.GetMyContextFromRoot(root))
                for law in loop.bare_controllers
            ]
        )
    np.testing.assert_allclose(efforts[1], 1.5 * np.array(efforts[0]), rtol=1e-9, atol=1e-9)
    assert np.abs(efforts[0]).max() > 0.1


def test_between_robots_only_reports_cross_in_a_deployment_too():
    loop = loop_of(control_rate=100.0, measurements=NOISE, messages=Messages(0.1, 0.1, 0.02))
    for (sink, entry), (source, output) in loop.diagram.connection_map().items():
        ends = (source.get_name(), sink.get_name())
        if "transport_station" not in ends:
            port = source.get_output_port(output).get_name(), sink.get_input_port(entry).get_name()
            assert port[0] in ("ready", "current_cell"), (ends, port)
